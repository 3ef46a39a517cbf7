"""What is compared: scenes made here as glTF files (surfaces that every renderer has, rough metals and dielectrics in a row), built-in ones
and files, and switches that take something out of a scene on both sides.
"""

import base64
import json
import os
import shutil
from typing import NamedTuple

import numpy as np
import OpenEXR


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


def write_mixtures(path):
    """A row of balls whose materials are trees of others with constant weights, which are blends in Mitsuba.

    No leaf sends light on in single directions: Mitsuba's blend (3.9.1) takes the probability of such a direction for a density and mixes it with
    that of the other part. A perfect conductor with the share 0.1, 0.3, 0.5, 0.7, 0.9 beside a black surface reflects 0.26, 0.58, 0.76, 0.88, 0.97 of
    what it should there.
    """
    materials = [
        material("floor", (0.5, 0.5, 0.5)),
        material("wall", (0.6, 0.55, 0.5)),
        material("lamp", (0.5, 0.5, 0.5), emissive=(9.0, 8.5, 8.0)),
        material("matte", (0.7, 0.2, 0.15), ior=1.0),
        material("polished", (0.95, 0.95, 0.95), 1.0, 0.2),
        material("metal", (0.95, 0.7, 0.35), 1.0, 0.4),
        material("coated", (0.2, 0.35, 0.6), 0.0, 0.3),
    ]
    meshes = [
        (*quad((-4, 0, 3), (8, 0, 0), (0, 0, -6)), 0),
        (*quad((-4, 0, -3), (8, 0, 0), (0, 4, 0)), 1),
        (*quad((-1.5, 3.9, 1.5), (0, 0, -3), (3, 0, 0)), 2),
    ]
    inner = {"over": "metal", "weight": 0.6, "under": "matte"}
    trees = [
        {"mix": [{"weight": 0.3, "of": "polished"}, {"weight": 0.7, "of": "matte"}]},
        inner,
        {"over": "coated", "weight": 0.25, "under": inner},
        {"mix": [{"weight": 0.3, "of": "metal"}, {"weight": 0.3, "of": "coated"}]},
        {"mix": [{"weight": 0.4, "of": inner}, {"weight": 0.35, "of": "polished"}, {"weight": 0.25, "of": "coated"}]},
    ]
    for index, tree in enumerate(trees):
        materials.append(material(f"tree {index}", (1.0, 1.0, 1.0)) | {"extras": {"material_tree": tree}})
        meshes.append((*sphere((-2.4 + 1.2 * index, 0.5, 0.3 - 0.6 * (index % 2)), 0.5), len(materials) - 1))
    write_gltf(path, meshes, materials, ((0.0, 2.2, 6.0), (0.0, 0.7, 0.0), 40.0))


def write_matte_box(path, lamp_has_back=False):
    """The built-in Cornell box without the coat that glTF puts over every dielectric: Lambert alone, which every renderer has.

    Cycles' lamps shine from their backs too; with `lamp_has_back` so does this one.
    """
    w, h, d = 0.5528, 0.5488, 0.5592
    materials = [
        material("white", (0.73, 0.73, 0.73), ior=1.0),
        material("red", (0.63, 0.065, 0.05), ior=1.0),
        material("green", (0.14, 0.45, 0.091), ior=1.0),
        material("lamp", (0.78, 0.78, 0.78), emissive=(17.0, 12.0, 4.0), ior=1.0),
    ]
    materials[3]["doubleSided"] = lamp_has_back
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


class Scene(NamedTuple):
    """What is rendered: a file or a built-in name, options of the path tracer, samples per pixel; Mitsuba's panorama so many times finer,
    and whether Mitsuba softens shadows under normal maps."""

    file: str
    options: list
    samples: int
    sky_factor: int = 1
    is_softened: bool = False


# What the model in Cycles cannot say.
OF_MITSUBA = ("mixtures",)
# Known names that are no scenes: the two made in Blender, and the clock.
FROM_BLENDER, TO_BLENDER, SPEED = "from-blender", "matte-box-to-blender", "speed"
SWITCHES = ("fine-sky", "softened", "plain-sky", "opaque", "no-normal-maps", "flat")


def known_scenes(folder, assets):
    """By name; `None` for those whose file is not there."""
    row, matte = os.path.join(folder, "row.gltf"), os.path.join(folder, "matte_box.gltf")
    mixtures = os.path.join(folder, "mixtures.gltf")
    write_row(row)
    write_mixtures(mixtures)
    write_matte_box(matte)
    square = ["--size", "128x128", "--depth", "16"]
    asset = lambda *parts: os.path.join(assets or "", *parts)  # noqa: E731
    sky = asset("env", "kloppenheim_05_1k.hdr")
    scenes = {
        "matte-box": Scene(matte, square, 64),
        "cornell-box": Scene("cornell-box", square, 64),
        "cornell-box-bevy": Scene(asset("gltf", "CornellBox-bevy.glb"), square, 64),
        "row": Scene(row, ["--size", "160x96", "--depth", "16"], 64),
        "mixtures": Scene(mixtures, ["--size", "160x96", "--depth", "16"], 64),
        "mirror-corridor": Scene("mirror-corridor", ["--size", "128x128", "--depth", "32"], 64),
        "kitchen": Scene(asset("gltf", "interior_kitchen_luxcore.glb"), ["--size", "128x128", "--depth", "8"], 64),
        "flight-helmet": Scene(asset("gltf", "FlightHelmet", "FlightHelmet.gltf"), [*square, "--env", sky], 64),
    }
    return {name: scene if scene.file == name or os.path.exists(scene.file) else None for name, scene in scenes.items()}


def chosen_scenes(names, folder, assets):
    """Those that are named, or all: pairs of a name and a scene, in the order of the names. A name may end in switches, each after a plus."""
    scenes = known_scenes(folder, assets)
    names = [name for name in names or scenes if name not in (FROM_BLENDER, TO_BLENDER, SPEED)]
    return [(name, switched(name, scenes, folder)) for name in names]


def switched(name, scenes, folder):
    base, *switches = name.split("+")
    if base not in scenes:
        raise SystemExit(f"there is no scene `{base}`: {', '.join([*scenes, FROM_BLENDER, TO_BLENDER, SPEED])}")
    unknown = [switch for switch in switches if switch not in SWITCHES]
    if unknown:
        raise SystemExit(f"there is no switch `{unknown[0]}`: {', '.join(SWITCHES)}")
    scene = scenes[base]
    if scene is None:
        return None
    if "fine-sky" in switches:
        scene = scene._replace(sky_factor=4)
    if "softened" in switches:
        scene = scene._replace(is_softened=True)
    if "plain-sky" in switches:
        if "--env" not in scene.options:
            raise SystemExit(f"{name}: there is no sky that could be plain")
        sky = os.path.join(folder, "plain_sky.exr")
        with OpenEXR.File({}, {"RGB": np.ones((8, 16, 3), np.float32)}) as file:
            file.write(sky)
        scene = scene._replace(options=[*scene.options[: scene.options.index("--env")], "--env", sky])
    if {"opaque", "no-normal-maps", "flat"} & set(switches):
        scene = scene._replace(file=changed_gltf(scene.file, name, switches, folder))
    return scene


def changed_gltf(source, name, switches, folder):
    """A copy of a glTF file with its neighbours, without what the switches take out."""
    if not source.endswith(".gltf"):
        raise SystemExit(f"{source}: only files that end in .gltf can be changed")
    place = os.path.join(folder, name)
    shutil.copytree(os.path.dirname(source), place, dirs_exist_ok=True, copy_function=shutil.copyfile)
    with open(source, encoding="utf-8") as file:
        document = json.load(file)
    for entry in document["materials"]:
        if "opaque" in switches:
            entry.pop("alphaMode", None)
        if "no-normal-maps" in switches or "flat" in switches:
            entry.pop("normalTexture", None)
    for primitive in (primitive for mesh in document["meshes"] for primitive in mesh["primitives"]):
        if "flat" in switches:
            for attribute in ("NORMAL", "TANGENT"):
                primitive["attributes"].pop(attribute, None)
    path = os.path.join(place, os.path.basename(source))
    with open(path, "w", encoding="utf-8") as file:
        json.dump(document, file)
    return path
