"""Train the network of ``houseexpo.predict_map`` on explorations of plans and of made office floors.

``houseexpo train predictor`` is the command; ``training.train_predictor`` does the work.
"""
