"""How much light a dielectric coat reflects, integrated by a rule of its own (a grid over half-vectors), not read from the renderer.

E = f0 A + B for a GGX interface under Schlick's reflectance, by roughness and the square root of the cosine.
Sources: Kulla and Conty, Revisiting Physically Based Shading at Imageworks, 2017; Heitz, 2014 and 2018.
"""

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


def ramps(stops):
    """A and B times the cosine, as functions that are linear in the cosine between so many stops and 0 at the first, by roughness.

    Least squares over the hemisphere; their integrals are those of the table, as a constraint.
    """
    count = 4096
    cosine = (np.arange(count) + 0.5) / count
    hats = np.maximum(0, 1 - np.abs(cosine[:, None] * (stops - 1) - np.arange(1, stops)))
    system = np.zeros((stops, stops))
    system[:-1, :-1] = hats.T @ hats / count
    system[-1, :-1] = system[:-1, -1] = 2 * hats.mean(axis=0)
    result = np.zeros((ROUGHNESSES, stops, 2))
    for row in range(ROUGHNESSES):
        for part in range(2):
            values = cosine * np.interp(np.sqrt(cosine), T, TABLE[row, :, part])
            right = np.append(hats.T @ values / count, MEANS[row, 0, part])
            result[row, 1:, part] = np.linalg.solve(system, right)[:-1]
    return result
