"""How much of a perfect conductor's reflection Mitsuba's `blendbsdf` keeps, when the rest of the blend is black: it should keep all of its share.

A wall behind the camera, lit by a point, is seen in the blend; its radiance over that of the conductor alone, divided by the share.
Run by the Python of `cargo xtask peers`: `target/tools/peers/bin/python crates/xtask/peers/blend_of_a_conductor.py`.
"""

import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")

CONDUCTOR = '<bsdf type="conductor"><string name="material" value="none"/></bsdf>'
BLACK = '<bsdf type="diffuse"><rgb name="reflectance" value="0,0,0"/></bsdf>'


def seen(bsdf):
    """Mean radiance of the middle of the picture."""
    scene = mi.load_string(
        '<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="3"/><integer name="rr_depth" value="1000"/></integrator>'
        '<sensor type="orthographic"><transform name="to_world"><lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform>'
        '<sampler type="independent"/><film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/>'
        f'<rfilter type="box"/></film></sensor><shape type="rectangle">{bsdf}</shape>'
        '<shape type="rectangle"><transform name="to_world"><scale value="20"/><rotate y="1" angle="180"/><translate z="8"/></transform>'
        '<bsdf type="diffuse"/></shape><emitter type="point"><point name="position" x="0" y="6" z="4"/>'
        '<rgb name="intensity" value="30,30,30"/></emitter></scene>'
    )
    return np.array(mi.render(scene, spp=1024, seed=1))[4:12, 4:12].mean()


def main():
    whole = seen(CONDUCTOR)
    for share in (0.1, 0.3, 0.5, 0.7, 0.9):
        blend = f'<bsdf type="blendbsdf"><float name="weight" value="{1 - share}"/>{CONDUCTOR}{BLACK}</bsdf>'
        print(f"share {share}: {seen(blend) / (share * whole):.2f} of what it should reflect")


if __name__ == "__main__":
    main()
