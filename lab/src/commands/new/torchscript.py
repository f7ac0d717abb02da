import torch
---
model = torch.jit.load(PATH, map_location="cpu").eval()
# For a file .pt2: model = torch.export.load(PATH).module()


def ask(seen):
    """The outputs of the model; of several tensors the first."""
    with torch.no_grad():
        answer = model(torch.tensor([seen], dtype=torch.float32))
    answer = answer[0] if isinstance(answer, tuple) else answer
    return answer.flatten().tolist()
