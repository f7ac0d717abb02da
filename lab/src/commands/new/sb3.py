import pickle

import numpy as np
from stable_baselines3 import PPO  # or A2C, DDPG, DQN, SAC, TD3: the class that was trained
---
NORMALISER = None  # "vec_normalize.pkl" if the model was trained in a VecNormalize

model = PPO.load(PATH, device="cpu")
if NORMALISER:
    with open(os.path.join(os.path.dirname(PATH), NORMALISER), "rb") as file:
        normaliser = pickle.load(file)


def ask(seen):
    """The outputs of the model: an action, or a number for each choice."""
    seen = np.array(seen, np.float32)
    if NORMALISER:
        seen = normaliser.normalize_obs(seen)
    answer, _ = model.predict(seen, deterministic=True)
    if hasattr(model.action_space, "n"):  # it answers with the number of a choice
        return [float(choice == answer) for choice in range(model.action_space.n)]
    return answer.tolist()
