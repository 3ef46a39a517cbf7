"""The surface model of wavepool's path tracer for Mitsuba 3, written from the formulas alone.

A GGX interface under Schlick's reflectance over a Lambert base. The base is rho/pi (1 - E(wo)) (1 - E(wi)) / (1 - E_avg), E the directional
albedo of the dielectric coat, which is integrated here by a rule of its own (a grid over half-vectors), not read from the renderer.
Sources: glTF 2.0, appendix B; Kulla and Conty, Revisiting Physically Based Shading at Imageworks, 2017; Heitz, 2014 and 2018.
"""

import drjit as dr
import mitsuba as mi
import numpy as np

ROUGHNESSES = 33
COSINES = 65


def schlick(cosine):
    return (1 - np.clip(cosine, 0, 1)) ** 5


def albedo_table():
    """A and B of E = f0 A + B, by roughness and the square root of the cosine."""
    table = np.zeros((ROUGHNESSES, COSINES, 2))
    # Midpoints in both coordinates of the disc of visible normals' projections.
    rings, spokes = 160, 64
    u, v = np.meshgrid((np.arange(rings) + 0.5) / rings, (np.arange(spokes) + 0.5) / spokes, indexing="ij")
    for row in range(ROUGHNESSES):
        alpha = (row / (ROUGHNESSES - 1)) ** 2
        for column in range(COSINES):
            z = max((column / (COSINES - 1)) ** 2, 1e-6)
            if alpha < 1e-6:
                table[row, column] = 1 - schlick(z), schlick(z)
                continue
            wo = np.array([np.sqrt(1 - z * z), 0, z])
            stretched = np.array([alpha * wo[0], 0, wo[2]])
            stretched /= np.linalg.norm(stretched)
            # Heitz 2018: visible normals of the stretched hemisphere are uniform over a projected disc.
            radius, angle = np.sqrt(u), 2 * np.pi * v
            p1, p2 = radius * np.cos(angle), radius * np.sin(angle)
            s = 0.5 * (1 + stretched[2])
            p2 = (1 - s) * np.sqrt(1 - p1 * p1) + s * p2
            across = np.array([0.0, 1.0, 0.0])
            along = np.cross(stretched, across)
            n = p1[..., None] * across + p2[..., None] * along + np.sqrt(np.maximum(0, 1 - p1 * p1 - p2 * p2))[..., None] * stretched
            h = np.stack([alpha * n[..., 0], alpha * n[..., 1], np.maximum(1e-6, n[..., 2])], -1)
            h /= np.linalg.norm(h, axis=-1, keepdims=True)
            cosine = h @ wo
            wi = 2 * cosine[..., None] * h - wo

            def smith(z2):
                return 0.5 * (np.sqrt(1 + alpha * alpha * (1 - z2) / z2) - 1)

            lambda_o = smith(wo[2] ** 2)
            lambda_i = smith(np.maximum(wi[..., 2], 1e-9) ** 2)
            weight = np.where(wi[..., 2] > 0, (1 + lambda_o) / (1 + lambda_o + lambda_i), 0)
            reflected = schlick(cosine)
            table[row, column] = (weight * (1 - reflected)).mean(), (weight * reflected).mean()
    return table


TABLE = albedo_table()
# Cosine-weighted means: 2 z dz = 4 t^3 dt with z = t^2, by trapezoids in t.
T = np.linspace(0, 1, COSINES)
WEIGHTS = 4 * T**3 / (COSINES - 1)
WEIGHTS[-1] *= 0.5
MEANS = (TABLE * WEIGHTS[None, :, None]).sum(axis=1)[:, None, :] / WEIGHTS.sum()


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
        self.m_components = [reflection]
        self.m_flags = reflection

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
        return base, f0, f90, dr.maximum(roughness * roughness, 1e-3), roughness

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
        ggx = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, alpha, True)
        h = dr.normalize(viewer + light)
        weight = dr.power(1 - dr.clip(dr.dot(viewer, h), 0, 1), 5)
        fresnel = f0 + (f90 - f0) * weight

        def smith(w):
            z2 = w.z * w.z
            return 0.5 * (dr.sqrt(1 + alpha * alpha * (1 - z2) / z2) - 1)

        masked = ggx.eval(h) / (4 * viewer.z) / (1 + smith(viewer) + smith(light))
        diffuse = base * (dr.inv_pi * light.z * self.through(viewer.z, roughness, active) * self.through(light.z, roughness, active))
        interface = self.interface_share(viewer, base, f0, f90, roughness, active)
        pdf = interface * ggx.pdf(viewer, h) / (4 * dr.dot(viewer, h)) + (1 - interface) * dr.inv_pi * light.z
        return dr.select(active, diffuse + fresnel * masked, 0), dr.select(active, pdf, 0)

    def interface_share(self, viewer, base, f0, f90, roughness, active):
        weight = dr.power(1 - dr.clip(viewer.z, 0, 1), 5)
        of_interface = dr.max(f0 + (f90 - f0) * weight)
        of_base = dr.max(base) * self.through(viewer.z, roughness, active)
        return of_interface / dr.maximum(of_interface + of_base, 1e-9)

    def eval(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[1]

    def sample(self, ctx, si, sample1, sample2, active=True):
        viewer = si.wi
        base, f0, f90, alpha, roughness = self.surface(si, active)
        ggx = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, alpha, True)
        interface = self.interface_share(viewer, base, f0, f90, roughness, active)
        h, _ = ggx.sample(viewer, sample2)
        mirrored = mi.reflect(viewer, h)
        light = dr.select(sample1 < interface, mirrored, mi.warp.square_to_cosine_hemisphere(sample2))
        bs = mi.BSDFSample3f()
        bs.wo = light
        bs.eta = 1.0
        bs.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
        bs.sampled_component = mi.UInt32(0)
        value, bs.pdf = self.eval_pdf(ctx, si, light, active)
        active = active & (bs.pdf > 0)
        return bs, dr.select(active, value / dr.maximum(bs.pdf, 1e-20), 0)

    def traverse(self, callback):
        pass

    def to_string(self):
        return "wavepool[]"


mi.register_bsdf("wavepool", lambda props: Model(props))
