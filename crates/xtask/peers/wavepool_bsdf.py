"""The surface model of wavepool's path tracer for Mitsuba 3, written from the formulas alone.

A GGX interface under Schlick's reflectance over a Lambert base. The base is rho/pi (1 - E(wo)) (1 - E(wi)) / (1 - E_avg), E the directional
albedo of the dielectric coat (coat_albedo.py).
Sources: glTF 2.0, appendix B; Kulla and Conty, Revisiting Physically Based Shading at Imageworks, 2017; Heitz, 2014 and 2018.
"""

import drjit as dr
import mitsuba as mi
from coat_albedo import COSINES, MEANS, ROUGHNESSES, TABLE

# Narrower distributions are mirrors.
ALPHA_MIRROR = 1e-3


class Model(mi.BSDF):
    """Parameters: base_color, metallic, roughness (numbers or textures), ior."""

    def __init__(self, props):
        super().__init__(props)
        self.base_color = props["base_color"]
        self.metallic = props["metallic"]
        self.roughness = props["roughness"]
        ior = props["ior"]
        self.f0 = ((ior - 1) / (ior + 1)) ** 2
        self.has_coat = ior != 1.0
        self.parts = mi.Texture2f(mi.TensorXf(TABLE), wrap_mode=dr.WrapMode.Clamp)
        self.means = mi.Texture2f(mi.TensorXf(MEANS), wrap_mode=dr.WrapMode.Clamp)
        reflection = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide
        self.m_components = [reflection, mi.BSDFFlags.DeltaReflection | mi.BSDFFlags.FrontSide]
        self.m_flags = reflection | mi.BSDFFlags.DeltaReflection

    def number(self, parameter, si, active):
        return parameter.eval_1(si, active) if hasattr(parameter, "eval_1") else mi.Float(parameter)

    def albedo(self, table, x, roughness, active):
        # The nodes of a table are the centres of its texels.
        y = (roughness * (ROUGHNESSES - 1) + 0.5) / ROUGHNESSES
        a, b = table.eval(mi.Point2f(x, y), active)
        return self.f0 * a + b

    def surface(self, si, active):
        """Base under the coat, the interface at normal incidence and at the horizon, its width, the roughness."""
        color = self.base_color.eval(si, active) if hasattr(self.base_color, "eval") else mi.Color3f(self.base_color)
        metallic = self.number(self.metallic, si, active)
        roughness = self.number(self.roughness, si, active)
        base = color * (1 - metallic)
        if self.has_coat:
            f0 = color * metallic + (1 - metallic) * self.f0
            f90 = mi.Float(1)
            base = base / (1 - self.albedo(self.means, 0.5, roughness, active))
        else:
            f0, f90 = color * metallic, metallic
        return base, f0, f90, roughness * roughness, roughness

    def fresnel(self, f0, f90, cosine):
        return f0 + (f90 - f0) * dr.power(1 - dr.clip(cosine, 0, 1), 5)

    def through(self, cosine, roughness, active):
        if not self.has_coat:
            return mi.Float(1)
        x = (dr.sqrt(dr.clip(cosine, 0, 1)) * (COSINES - 1) + 0.5) / COSINES
        return 1 - self.albedo(self.parts, x, roughness, active)

    def eval_pdf(self, ctx, si, wo, active=True):
        # Mitsuba's wi is the direction of the viewer.
        viewer, light = si.wi, wo
        active = active & (viewer.z > 0) & (light.z > 0)
        base, f0, f90, alpha, roughness = self.surface(si, active)
        is_mirror = alpha < ALPHA_MIRROR
        alpha = dr.maximum(alpha, ALPHA_MIRROR)
        ggx = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, alpha, True)
        h = dr.normalize(viewer + light)
        fresnel = dr.select(is_mirror, 0, self.fresnel(f0, f90, dr.dot(viewer, h)))

        def smith(w):
            z2 = w.z * w.z
            return 0.5 * (dr.sqrt(1 + alpha * alpha * (1 - z2) / z2) - 1)

        masked = ggx.eval(h) / (4 * viewer.z) / (1 + smith(viewer) + smith(light))
        diffuse = base * (dr.inv_pi * light.z * self.through(viewer.z, roughness, active) * self.through(light.z, roughness, active))
        interface = self.interface_share(viewer, base, f0, f90, roughness, active)
        pdf = (1 - interface) * dr.inv_pi * light.z
        pdf += dr.select(is_mirror, 0, interface * ggx.pdf(viewer, h) / (4 * dr.dot(viewer, h)))
        return dr.select(active, diffuse + fresnel * masked, 0), dr.select(active, pdf, 0)

    def interface_share(self, viewer, base, f0, f90, roughness, active):
        of_interface = dr.max(self.fresnel(f0, f90, viewer.z))
        of_base = dr.max(base) * self.through(viewer.z, roughness, active)
        return of_interface / dr.maximum(of_interface + of_base, 1e-9)

    def eval(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[1]

    def sample(self, ctx, si, sample1, sample2, active=True):
        viewer = si.wi
        base, f0, f90, alpha, roughness = self.surface(si, active)
        is_mirror = alpha < ALPHA_MIRROR
        alpha = dr.maximum(alpha, ALPHA_MIRROR)
        ggx = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, alpha, True)
        interface = self.interface_share(viewer, base, f0, f90, roughness, active)
        takes_interface = sample1 < interface
        takes_mirror = takes_interface & is_mirror
        h, _ = ggx.sample(viewer, sample2)
        h = dr.select(is_mirror, mi.Normal3f(0, 0, 1), h)
        light = dr.select(takes_interface, mi.reflect(viewer, h), mi.warp.square_to_cosine_hemisphere(sample2))
        value, pdf = self.eval_pdf(ctx, si, light, active)
        # A mirror's direction has a probability and no density.
        value = dr.select(takes_mirror, self.fresnel(f0, f90, viewer.z), value)
        bs = mi.BSDFSample3f()
        bs.wo = light
        bs.eta = 1.0
        bs.pdf = dr.select(takes_mirror, interface, pdf)
        bs.sampled_type = dr.select(takes_mirror, mi.UInt32(+mi.BSDFFlags.DeltaReflection), mi.UInt32(+mi.BSDFFlags.GlossyReflection))
        bs.sampled_component = dr.select(takes_mirror, mi.UInt32(1), mi.UInt32(0))
        active = active & (viewer.z > 0) & (bs.pdf > 0)
        return bs, dr.select(active, value / dr.maximum(bs.pdf, 1e-20), 0)

    def traverse(self, callback):
        pass

    def to_string(self):
        return "wavepool[]"


def register():
    mi.register_bsdf("wavepool", lambda props: Model(props))
