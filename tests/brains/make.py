#!/usr/bin/env python3
"""Makes the files of weights that the tests read, and what they must answer.

    python3 -m pip install numpy==2.4.6 safetensors==0.8.0
    python3 tests/brains/make.py

PyTorch is not needed: a checkpoint is a zip with a pickle, and the few names
that `torch.save` writes into it stand below as classes of no content. The
weights are drawn from a seed; the answers are computed in double precision
from the single-precision weights and observations, so that whatever rounds in
single precision can be held against them.

actor.safetensors     float32
actor.pt              float32, as torch.save writes a state dictionary
parameters.pt         Parameter wrappers, float64, weights stored transposed in
                      one storage with an offset, in pickle protocol 4
half.pt               float16
asks.pt               a pickle that asks for os.system
legacy.pt             the format before PyTorch 1.6, as far as its first bytes
answers.txt           for actor.*: 1,000 answers to the observations that numpy's
                      default_rng(0) draws, five at a time, from -1 to 1
"""

import collections
import io
import os
import pickle
import sys
import types
import zipfile
from pathlib import Path

import numpy as np
from safetensors.numpy import save_file

HERE = Path(__file__).parent
WIDTH = 64
SHAPES = [(WIDTH, 5), (WIDTH,), (WIDTH, WIDTH), (WIDTH,), (1, WIDTH), (1,)]
NAMES = [f"actor_mean.{i}.{part}" for i in (0, 2, 4) for part in ("weight", "bias")]
KINDS = {"float16": "HalfStorage", "float32": "FloatStorage", "float64": "DoubleStorage"}


def stand_in(module, name):
    """A function that pickles under the name of one of PyTorch's."""
    def function(*_):
        raise NotImplementedError
    function.__module__, function.__name__, function.__qualname__ = module, name, name
    package = sys.modules.setdefault(module, types.ModuleType(module))
    setattr(package, name, function)
    return function


REBUILD_TENSOR = stand_in("torch._utils", "_rebuild_tensor_v2")
REBUILD_PARAMETER = stand_in("torch._utils", "_rebuild_parameter")
STORAGES = {kind: stand_in("torch", name) for kind, name in KINDS.items()}


class Storage:
    """Numbers that go into an entry of their own."""
    def __init__(self, key, numbers):
        self.key, self.numbers = str(key), numbers


class Called:
    """What is pickled as a call."""
    def __init__(self, function, *arguments):
        self.call = (function, arguments)

    def __reduce__(self):
        return self.call


class Pickler(pickle.Pickler):
    def persistent_id(self, value):
        if not isinstance(value, Storage):
            return None
        kind = STORAGES[value.numbers.dtype.name]
        return ("storage", kind, value.key, "cpu", value.numbers.size)


def tensor(storage, offset, shape, strides):
    return Called(REBUILD_TENSOR, storage, offset, shape, strides, False, collections.OrderedDict())


def save(name, state, storages, protocol=2):
    """Writes a zip as torch.save does: stored, one folder."""
    stream = io.BytesIO()
    Pickler(stream, protocol=protocol).dump(state)
    with zipfile.ZipFile(HERE / name, "w", zipfile.ZIP_STORED) as archive:
        def write(entry, content):
            archive.writestr(zipfile.ZipInfo(f"{Path(name).stem}/{entry}"), content)
        write("data.pkl", stream.getvalue())
        write("byteorder", "little")
        for storage in storages:
            write(f"data/{storage.key}", storage.numbers.tobytes())
        write("version", "3\n")


def plain(tensors):
    """A tensor to a storage."""
    state, storages = collections.OrderedDict(), []
    for key, (name, numbers) in enumerate(tensors.items()):
        storage = Storage(key, numbers.ravel())
        strides = (numbers.shape[1], 1) if numbers.ndim == 2 else (1,)
        state[name] = tensor(storage, 0, numbers.shape, strides)
        storages.append(storage)
    return state, storages


def strided(tensors):
    """All tensors in one storage, matrices column by column, as parameters."""
    parts, state, offset = [np.zeros(3)], collections.OrderedDict(), 3
    storage = Storage("all", None)
    for name, numbers in tensors.items():
        parts.append(numbers.T.ravel().astype(np.float64))
        strides = (1, numbers.shape[0]) if numbers.ndim == 2 else (1,)
        view = tensor(storage, offset, numbers.shape, strides)
        state[name] = Called(REBUILD_PARAMETER, view, True, collections.OrderedDict())
        offset += numbers.size
    storage.numbers = np.concatenate(parts)
    return state, [storage]


def answer(tensors, observations):
    """What the network says, in double precision."""
    layer = observations.astype(np.float64)
    for i in (0, 2, 4):
        weight = tensors[f"actor_mean.{i}.weight"].astype(np.float64)
        layer = layer @ weight.T + tensors[f"actor_mean.{i}.bias"].astype(np.float64)
        layer = np.tanh(layer) if i < 4 else layer
    return layer[:, 0]


def main():
    rng = np.random.default_rng(1)
    scale = lambda shape: 1.0 if len(shape) == 1 else 1.5 / np.sqrt(shape[1])
    tensors = {name: rng.normal(0, scale(shape), shape).astype(np.float32)
               for name, shape in zip(NAMES, SHAPES)}
    tensors["critic.0.weight"] = np.zeros((2, 5), np.float32)
    save_file(tensors, HERE / "actor.safetensors")
    save("actor.pt", *plain(tensors))
    save("parameters.pt", *strided(tensors), protocol=4)
    save("half.pt", *plain({name: t.astype(np.float16) for name, t in tensors.items()}))
    save("asks.pt", {"actor_mean.0.weight": Called(os.system, "echo harm")}, [])
    (HERE / "legacy.pt").write_bytes(pickle.dumps(0x1950A86A20F9469CFC6C, protocol=2))
    observations = np.random.default_rng(0).uniform(-1, 1, (1000, 5)).astype(np.float32)
    lines = (repr(float(number)) for number in answer(tensors, observations))
    (HERE / "answers.txt").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
