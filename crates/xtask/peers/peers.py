"""Compares wavepool's path tracer with Mitsuba 3: the same geometry, light, film and number of samples, from the files that
`path-tracer export --mitsuba` writes.

Every scene is rendered a number of times by both, with other seeds. Their means are compared with a confidence interval, and every tile of
16x16 pixels by Welch's test, whose threshold is Bonferroni's for all tiles and channels. Surfaces are the model of wavepool_bsdf.py, written
from the formulas, so that only light transport, textures, cameras and lights are on trial. Speeds are taken in turns, warm.

usage: peers.py PATH_TRACER FOLDER [--assets FOLDER] [--quick] [SCENE ...]
"""

import argparse
import os
import statistics
import time

import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")
import drjit as dr  # noqa: E402
import wavepool_bsdf  # noqa: E402
from path_tracer_call import export, picture_of, render  # noqa: E402
from scenes import SPEED, chosen_scenes, known_scenes  # noqa: E402
from statistics_of_tiles import judge, table_head  # noqa: E402


class Peers:
    def __init__(self, arguments):
        self.path_tracer, self.folder, self.quick = arguments.path_tracer, arguments.folder, arguments.quick
        self.runs = 4 if arguments.quick else 8
        os.makedirs(self.folder, exist_ok=True)

    def load(self, xml, has_roulette, is_softened=False):
        with open(xml, encoding="utf-8") as file:
            text = file.read()
        if not is_softened:
            # Mitsuba darkens what a normal map bends out of the light; the formulas do not.
            text = text.replace('type="normalmap">', 'type="normalmap"><boolean name="use_shadowing_function" value="false"/>')
        if not has_roulette:
            text = text.replace('name="rr_depth" value="5"', 'name="rr_depth" value="1000000"')
        xml = xml.replace(".xml", "_of_peer.xml")
        with open(xml, "w", encoding="utf-8") as file:
            file.write(text)
        return mi.load_file(xml)

    def ours(self, scene, options, samples, seed, schedule):
        return render(self.path_tracer, scene, options, samples, seed, schedule)

    def refine_sky(self, name, factor):
        """Repeats every texel of the exported panorama: what Mitsuba interpolates becomes narrower by the factor."""
        file = os.path.join(self.folder, f"{name}_parts", "environment.exr")
        texels = picture_of(file)
        height = factor * len(texels)
        # Mitsuba's first and last rows lie on the poles.
        rows = np.minimum(np.arange(height) / (height - 1) * len(texels), len(texels) - 1).astype(int)
        mi.Bitmap(np.repeat(texels[rows], factor, axis=1)).write(file)

    def agree(self, name, scene, has_roulette):
        roulette, samples = "lane" if has_roulette else "none", scene.samples
        xml = export(self.path_tracer, name, scene.file, scene.options, self.folder)
        if scene.sky_factor > 1:
            self.refine_sky(name, scene.sky_factor)
        loaded = self.load(xml, has_roulette, scene.is_softened)
        ours, theirs = [], []
        for seed in range(self.runs):
            ours.append(self.ours(scene.file, scene.options, samples, seed, f"megakernel,roulette={roulette}")[0])
            theirs.append(np.array(mi.render(loaded, spp=samples, seed=seed)))
        judge(name, "Mitsuba", roulette, ours, theirs, samples, self.folder)

    def speed(self, scene, size, depth, samples, schedules):
        """Samples per second in turns; ours without compilation, from the difference of a long and a short run."""
        options = ["--size", f"{size}x{size}", "--depth", depth]
        xml = export(self.path_tracer, "speed", scene, options, self.folder, "standard")
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
    wavepool_bsdf.register()
    peers = Peers(arguments)
    print(f"mitsuba {mi.__version__}, {mi.variant()}\n")
    print(table_head())
    for name, scene in chosen_scenes(arguments.scenes, peers.folder, arguments.assets):
        if scene is None:
            print(f"| {name} | Mitsuba | | | skipped: no file | | | | |")
            continue
        for has_roulette in (True, False):
            peers.agree(name, scene, has_roulette)
    if not arguments.scenes or SPEED in arguments.scenes:
        print("\n| schedule | roulette | ours, Msamples/s | theirs | ours over theirs |")
        print("| --- | --- | ---: | ---: | --- |")
        peers.speed(known_scenes(peers.folder, None)["matte-box"].file, 256, 16, 64, ["megakernel", "megakernel-regen", "block"])


if __name__ == "__main__":
    main()
