"""Runs the path tracer and reads its pictures."""

import os
import re
import subprocess
import sys
import tempfile

import numpy as np
import OpenEXR


def call(arguments):
    """Runs the path tracer; what it prints is its account."""
    done = subprocess.run([str(a) for a in arguments], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, arguments))}\n{done.stderr}")
    return done.stdout


def picture_of(path):
    """Height x width x 3, linear."""
    with OpenEXR.File(path) as file:
        channels = file.channels()
        for name in ("RGB", "RGBA"):
            if name in channels:
                return np.asarray(channels[name].pixels, np.float32)[..., :3]
        return np.stack([np.asarray(channels[name].pixels, np.float32) for name in "RGB"], -1)


def render(path_tracer, scene, options, samples, seed, schedule):
    """The picture, and samples per second."""
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "ours.exr")
        account = call([path_tracer, "render", scene, *options, "--samples", samples, "--seed", seed, "--schedule", schedule, "--out", out])
        return picture_of(out), float(re.search(r"([\d.]+) Msamples/s", account)[1]) * 1e6


def export(path_tracer, name, scene, options, folder, materials="model"):
    """The scene for the peers: the path of an XML file with its parts beside it."""
    xml = os.path.join(folder, f"{name}.xml")
    call([path_tracer, "export", scene, *options, "--mitsuba", xml, "--materials", materials])
    return xml
