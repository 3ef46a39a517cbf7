"""Compares wavepool's path tracer with Mitsuba 3: the same geometry, light, film and number of samples, from the files that
`path-tracer export --mitsuba` writes.

Every scene is rendered a number of times by both, with other seeds. Their means are compared with a confidence interval, and every tile of
16x16 pixels by Welch's test, whose threshold is Bonferroni's for all tiles and channels. Surfaces are the model of wavepool_bsdf.py, written
from the formulas, so that only light transport, textures, cameras and lights are on trial. Speeds are taken in turns, warm.

usage: peers.py PATH_TRACER FOLDER [--assets FOLDER] [--quick] [SCENE ...]
"""

import argparse
import base64
import json
import os
import statistics
import time

import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")
import drjit as dr  # noqa: E402
import wavepool_bsdf  # noqa: E402, F401
from path_tracer_call import call, render  # noqa: E402
from statistics_of_tiles import judge, table_head  # noqa: E402



def sphere(center, radius, rings=48, spokes=96):
    """Vertices, normals and triangles of a sphere whose facets are small beside a pixel."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, spokes + 1), indexing="ij")
    normals = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], -1).reshape(-1, 3)
    ring, spoke = np.meshgrid(np.arange(rings), np.arange(spokes), indexing="ij")
    a = (ring * (spokes + 1) + spoke).ravel()
    b, c, d = a + 1, a + spokes + 1, a + spokes + 2
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([b, d, c], -1)])
    sines = np.sin(theta).reshape(-1)
    keep = (sines[faces] > 1e-9).sum(axis=1) >= 2
    return np.asarray(center) + radius * normals, normals, faces[keep]


def quad(corner, u, v):
    corner, u, v = map(np.asarray, (corner, u, v))
    normal = np.cross(u, v) / np.linalg.norm(np.cross(u, v))
    return np.array([corner, corner + u, corner + u + v, corner + v]), np.tile(normal, (4, 1)), np.array([[0, 1, 2], [0, 2, 3]])


def write_gltf(path, meshes, materials, camera):
    """A glTF file with everything inside. `meshes`: (vertices, normals, faces, material); `camera`: eye, target, vertical angle."""
    views, accessors, blob = [], [], b""

    def accessor(array, kind, component):
        nonlocal blob
        array = np.ascontiguousarray(array)
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": array.nbytes})
        entry = {"bufferView": len(views) - 1, "componentType": component, "count": len(array), "type": kind}
        if kind == "VEC3":
            entry |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        accessors.append(entry)
        blob += array.tobytes()
        return len(accessors) - 1

    primitives = []
    for vertices, normals, faces, material in meshes:
        primitives.append(
            {
                "attributes": {
                    "POSITION": accessor(vertices.astype("<f4"), "VEC3", 5126),
                    "NORMAL": accessor(normals.astype("<f4"), "VEC3", 5126),
                },
                "indices": accessor(faces.astype("<u4").ravel(), "SCALAR", 5125),
                "material": material,
            }
        )
    eye, target, angle = camera
    back = np.subtract(eye, target) / np.linalg.norm(np.subtract(eye, target))
    right = np.cross([0, 1, 0], back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = right, np.cross(back, right), back, eye
    used = sorted({name for material in materials for name in material.get("extensions", {})})
    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": used,
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0}, {"camera": 0, "matrix": matrix.T.ravel().tolist()}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": float(np.radians(angle)), "znear": 0.01}}],
        "meshes": [{"primitives": primitives}],
        "materials": materials,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(blob), "uri": "data:application/octet-stream;base64," + base64.b64encode(blob).decode()}],
    }
    with open(path, "w", encoding="utf-8") as file:
        json.dump(document, file)


def material(name, color, metallic=0.0, roughness=1.0, emissive=None, ior=None, transmission=None):
    entry = {
        "name": name,
        "doubleSided": emissive is None,
        "pbrMetallicRoughness": {"baseColorFactor": [*color, 1.0], "metallicFactor": metallic, "roughnessFactor": roughness},
    }
    extensions = {}
    if ior is not None:
        extensions["KHR_materials_ior"] = {"ior": ior}
    if transmission is not None:
        extensions["KHR_materials_transmission"] = {"transmissionFactor": transmission}
        extensions["KHR_materials_volume"] = {"thicknessFactor": 1.0}
    if emissive is not None:
        strength = max(emissive)
        entry["emissiveFactor"] = [value / strength for value in emissive]
        extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
    if extensions:
        entry["extensions"] = extensions
    return entry


def write_row(path):
    """Five metals of growing roughness behind five coated dielectrics, and a ball of glass, in a box with a lamp."""
    materials = [
        material("floor", (0.5, 0.5, 0.5)),
        material("wall", (0.6, 0.55, 0.5)),
        material("lamp", (0.5, 0.5, 0.5), emissive=(9.0, 8.5, 8.0)),
        material("glass", (0.95, 1.0, 0.97), roughness=0.0, ior=1.5, transmission=1.0),
    ]
    meshes = [
        (*quad((-4, 0, 3), (8, 0, 0), (0, 0, -6)), 0),
        (*quad((-4, 0, -3), (8, 0, 0), (0, 4, 0)), 1),
        (*quad((-1.5, 3.9, 1.5), (0, 0, -3), (3, 0, 0)), 2),
        (*sphere((0, 0.45, 2.0), 0.45), 3),
    ]
    for index, roughness in enumerate([0.1, 0.25, 0.45, 0.7, 1.0]):
        materials.append(material(f"metal {roughness}", (0.95, 0.7, 0.35), 1.0, roughness))
        meshes.append((*sphere((-2.2 + 1.1 * index, 0.5, -1.2), 0.5), len(materials) - 1))
        materials.append(material(f"dielectric {roughness}", (0.2, 0.35, 0.6), 0.0, roughness))
        meshes.append((*sphere((-2.0 + 1.0 * index, 0.4, 0.4), 0.4), len(materials) - 1))
    write_gltf(path, meshes, materials, ((0.0, 2.2, 6.0), (0.0, 0.7, 0.0), 40.0))


def write_matte_box(path):
    """The built-in Cornell box without the coat that glTF puts over every dielectric: Lambert alone, which every renderer has."""
    w, h, d = 0.5528, 0.5488, 0.5592
    materials = [
        material("white", (0.73, 0.73, 0.73), ior=1.0),
        material("red", (0.63, 0.065, 0.05), ior=1.0),
        material("green", (0.14, 0.45, 0.091), ior=1.0),
        material("lamp", (0.78, 0.78, 0.78), emissive=(17.0, 12.0, 4.0), ior=1.0),
    ]
    meshes = [
        (*quad((0, 0, 0), (0, 0, d), (w, 0, 0)), 0),
        (*quad((0, h, 0), (w, 0, 0), (0, 0, d)), 0),
        (*quad((0, 0, d), (0, h, 0), (w, 0, 0)), 0),
        (*quad((w, 0, 0), (0, 0, d), (0, h, 0)), 1),
        (*quad((0, 0, 0), (0, h, 0), (0, 0, d)), 2),
        (*quad((0.213, h - 0.0005, 0.227), (0.13, 0, 0), (0, 0, 0.105)), 3),
    ]
    for center, half, turn in [((0.1855, 0.0825, 0.169), (0.0825, 0.0825, 0.0825), 0.29), ((0.3685, 0.165, 0.351), (0.0825, 0.165, 0.0825), -0.3)]:
        x = np.array([np.cos(turn), 0, -np.sin(turn)]) * half[0]
        y, z = np.array([0, half[1], 0]), np.array([np.sin(turn), 0, np.cos(turn)]) * half[2]
        for a, b, c in [(x, y, z), (y, z, x), (z, x, y)]:
            meshes.append((*quad(np.array(center) + a - b - c, 2 * b, 2 * c), 0))
            meshes.append((*quad(np.array(center) - a - b - c, 2 * c, 2 * b), 0))
    write_gltf(path, meshes, materials, ((0.278, 0.273, -0.8), (0.278, 0.273, 0.0), 39.3))


class Peers:
    def __init__(self, arguments):
        self.path_tracer, self.folder, self.quick = arguments.path_tracer, arguments.folder, arguments.quick
        self.runs = 4 if arguments.quick else 8
        os.makedirs(self.folder, exist_ok=True)

    def export(self, name, scene, options, materials="model"):
        xml = os.path.join(self.folder, f"{name}.xml")
        call([self.path_tracer, "export", scene, *options, "--mitsuba", xml, "--materials", materials])
        return xml

    def load(self, xml, has_roulette=True):
        with open(xml, encoding="utf-8") as file:
            text = file.read()
        if not has_roulette:
            text = text.replace('name="rr_depth" value="5"', 'name="rr_depth" value="1000000"')
            xml = xml.replace(".xml", "_without_roulette.xml")
            with open(xml, "w", encoding="utf-8") as file:
                file.write(text)
        return mi.load_file(xml)

    def ours(self, scene, options, samples, seed, schedule):
        return render(self.path_tracer, scene, options, samples, seed, schedule)

    def agree(self, name, scene, options, samples, has_roulette):
        roulette = "lane" if has_roulette else "none"
        loaded = self.load(self.export(name, scene, options), has_roulette)
        ours, theirs = [], []
        for seed in range(self.runs):
            ours.append(self.ours(scene, options, samples, seed, f"megakernel,roulette={roulette}")[0])
            theirs.append(np.array(mi.render(loaded, spp=samples, seed=seed)))
        judge(name, roulette, ours, theirs, samples, self.folder)

    def speed(self, scene, size, depth, samples, schedules):
        """Samples per second in turns; ours without compilation, from the difference of a long and a short run."""
        options = ["--size", f"{size}x{size}", "--depth", depth]
        xml = self.export("speed", scene, options, "standard")
        rounds = 3 if self.quick else 7
        for has_roulette in (True, False):
            loaded = self.load(xml, has_roulette)
            dr.eval(mi.render(loaded, spp=samples, seed=99))
            dr.sync_thread()
            roulette = "lane" if has_roulette else "none"
            ratios = {schedule: [] for schedule in schedules}
            theirs, ours = [], {schedule: [] for schedule in schedules}
            for turn in range(rounds):
                begin = time.perf_counter()
                dr.eval(mi.render(loaded, spp=samples, seed=turn))
                dr.sync_thread()
                theirs.append(size * size * samples / (time.perf_counter() - begin))
                for schedule in schedules:
                    text = f"{schedule},roulette={roulette}"
                    short = samples / self.ours(scene, options, samples, turn, text)[1]
                    long = 3 * samples / self.ours(scene, options, 3 * samples, turn, text)[1]
                    ours[schedule].append(2 * samples / max(long - short, 1e-9))
                    ratios[schedule].append(ours[schedule][-1] / theirs[-1])
            for schedule in schedules:
                values = sorted(ratios[schedule])
                print(
                    f"| {schedule} | {roulette} | {statistics.median(ours[schedule]) / 1e6:.3f} | {statistics.median(theirs) / 1e6:.3f} | "
                    f"{statistics.median(values):.2f} [{values[0]:.2f}, {values[-1]:.2f}] |",
                    flush=True,
                )


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("path_tracer")
    parser.add_argument("folder")
    parser.add_argument("--assets")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("scenes", nargs="*")
    arguments = parser.parse_intermixed_args()
    peers = Peers(arguments)
    row, matte = os.path.join(peers.folder, "row.gltf"), os.path.join(peers.folder, "matte_box.gltf")
    write_row(row)
    write_matte_box(matte)
    square = ["--size", "128x128", "--depth", "16"]
    scenes = {
        "matte-box": (matte, square, 64),
        "cornell-box": ("cornell-box", square, 64),
        "row": (row, ["--size", "160x96", "--depth", "16"], 64),
        "mirror-corridor": ("mirror-corridor", square, 64),
    }
    if arguments.assets:
        asset = lambda *parts: os.path.join(arguments.assets, *parts)  # noqa: E731
        scenes |= {
            "cornell-box-bevy": (asset("gltf", "CornellBox-bevy.glb"), square, 64),
            "flight-helmet": (
                asset("gltf", "FlightHelmet", "FlightHelmet.gltf"),
                [*square, "--env", asset("env", "kloppenheim_05_1k.hdr")],
                64,
            ),
            "kitchen": (asset("gltf", "interior_kitchen_luxcore.glb"), ["--size", "128x128", "--depth", "8"], 64),
        }
    chosen = {name: scene for name, scene in scenes.items() if not arguments.scenes or name in arguments.scenes}
    print(f"mitsuba {mi.__version__}, {mi.variant()}\n")
    print(table_head())
    for name, (scene, options, samples) in chosen.items():
        if not (scene == name or os.path.exists(scene)):
            print(f"| {name} | | | skipped: no file | | | | |")
            continue
        for has_roulette in (True, False):
            peers.agree(name, scene, options, samples, has_roulette)
    if not arguments.scenes or "speed" in arguments.scenes:
        print("\n| schedule | roulette | ours, Msamples/s | theirs | ours over theirs |")
        print("| --- | --- | ---: | ---: | --- |")
        peers.speed(matte, 256, 16, 64, ["megakernel", "megakernel-regen", "block"])


if __name__ == "__main__":
    main()
