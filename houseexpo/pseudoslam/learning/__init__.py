"""Learning in PseudoSLAM: PPO on the robot's map, in runs that can be killed and resumed.

``houseexpo train`` is the command; ``training.train`` does the work. Only ``model``, ``network``, ``checkpoints``,
``evaluation``, ``policy_file`` and ``training`` import PyTorch and Stable-Baselines3 (the extra ``learn``).
"""
