"""The steps of Algorithm 1: one file, one public function a step."""
