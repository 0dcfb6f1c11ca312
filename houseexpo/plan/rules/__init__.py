"""The rules of the format that a schema cannot say, one function a rule: a plan in, what breaks the rule out."""
