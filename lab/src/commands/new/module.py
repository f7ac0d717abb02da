import torch
from torch.nn import Linear, ReLU, Sequential, Tanh  # and what else the network is made of
---
PREFIX = "actor_mean."  # the names of the actor begin with it: "" if they are "0.weight"

# The network that was trained: its layers, in order.
model = Sequential(Linear(4, 64), Tanh(), Linear(64, 64), Tanh(), Linear(64, 1))
state = torch.load(PATH, map_location="cpu", weights_only=True)
# If the state_dict is nested: state = state["model_state_dict"]
state = {name.removeprefix(PREFIX): state[name] for name in state if name.startswith(PREFIX)}
model.load_state_dict(state)


def ask(seen):
    """The outputs of the network."""
    with torch.no_grad():
        return model(torch.tensor([seen], dtype=torch.float32)).flatten().tolist()
