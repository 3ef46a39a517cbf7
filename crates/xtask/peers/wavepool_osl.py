"""The surface model of wavepool's path tracer for Cycles, as a shader in OSL made of closures that Cycles has.

The interface is Cycles' generalized Schlick closure over GGX without multiple scattering: the same formula as here. The base under a coat is
rho/pi (1 - E(wo)) (1 - E(wi)) / (1 - E_avg): what depends on the viewer is a weight, and 1 - E(wi) times the cosine is Cycles' diffuse ramp,
eight values that are joined linearly in the cosine (the closure has no cosine of its own). The ramp has the integral of the function that it
stands for, so that no light is lost or gained.
Smooth glass is Cycles' dielectric; a thin sheet reflects twice and lets the rest pass straight, by a refraction of index 1, which is
counted as a bounce (Cycles' transparency is not). Sources as in wavepool_bsdf.py.
"""

from coat_albedo import COSINES, MEANS, ROUGHNESSES, TABLE, ramps

# As many as Cycles' diffuse ramp has.
STOPS = 8

TEXT = """
#include "stdcycles.h"

#define ROUGHNESSES %(roughnesses)d
#define COSINES %(cosines)d
#define STOPS %(stops)d

float fresnel(float cosine_raw, float eta)
{
    float cosine = min(abs(cosine_raw), 1.0);
    float beyond = 1.0 - (1.0 - cosine * cosine) / (eta * eta);
    if (beyond <= 0.0)
        return 1.0;
    float t = sqrt(beyond);
    float s = (cosine - eta * t) / (cosine + eta * t);
    float p = (eta * cosine - t) / (eta * cosine + t);
    return 0.5 * (s * s + p * p);
}

shader wavepool(
    color BaseColor = 0.8, float Metallic = 0.0, float Roughness = 1.0, float Ior = 1.5,
    color Tint = 1.0, float GlassShare = 0.0, float GlassIor = 1.5, int IsSolid = 0, float Opacity = 1.0,
    normal Normal = N,
    output closure color Surface = 0)
{
    float TABLE[%(table_size)d] = {%(table)s};
    float MEANS[%(means_size)d] = {%(means)s};
    float RAMPS[%(ramps_size)d] = {%(ramps)s};

    float cosine = clamp(abs(dot(I, Normal)), 0.0, 1.0);
    float place = clamp(Roughness, 0.0, 1.0) * (ROUGHNESSES - 1);
    int row = min(int(place), ROUGHNESSES - 2);
    float blend = place - row;

    float dielectric = 1.0 - Metallic;
    color at_normal = Metallic * BaseColor;
    float at_horizon = Metallic;
    closure color surface = 0;
    if (Ior != 1.0) {
        float f0 = pow((Ior - 1.0) / (Ior + 1.0), 2.0);
        at_normal += dielectric * f0;
        at_horizon = 1.0;
        float column = sqrt(cosine) * (COSINES - 1);
        int left = min(int(column), COSINES - 2);
        float along = column - left;
        float reflected[2];
        float mean[2];
        for (int part = 0; part < 2; ++part) {
            int low = (row * COSINES + left) * 2 + part;
            int high = low + COSINES * 2;
            reflected[part] = mix(mix(TABLE[low], TABLE[low + 2], along), mix(TABLE[high], TABLE[high + 2], along), blend);
            mean[part] = mix(MEANS[row * 2 + part], MEANS[row * 2 + 2 + part], blend);
        }
        color base = BaseColor * (dielectric * (1.0 - f0 * reflected[0] - reflected[1]) / (1.0 - f0 * mean[0] - mean[1]));
        color stops[STOPS];
        for (int stop = 0; stop < STOPS; ++stop) {
            int low = (row * STOPS + stop) * 2;
            int high = low + STOPS * 2;
            float taken = f0 * mix(RAMPS[low], RAMPS[high], blend) + mix(RAMPS[low + 1], RAMPS[high + 1], blend);
            stops[stop] = color(max(0.0, stop / (STOPS - 1.0) - taken));
        }
        surface = base * diffuse_ramp(Normal, stops);
    } else {
        surface = (dielectric * BaseColor) * diffuse(Normal);
    }
    if (at_horizon > 0.0) {
        float alpha = Roughness * Roughness;
        alpha = select(alpha, 0.0, alpha < 0.001);
        surface += generalized_schlick_bsdf(
            Normal, vector(0.0), color(1.0), color(0.0), alpha, alpha, at_normal, color(at_horizon), 5.0, "ggx");
    }
    if (GlassShare > 0.0) {
        closure color glass = 0;
        if (IsSolid != 0) {
            float eta = GlassIor;
            if (backfacing())
                eta = 1.0 / GlassIor;
            glass = dielectric_bsdf(Normal, vector(0.0), color(1.0), Tint, 0.0, 0.0, eta, "ggx");
        } else {
            float once = fresnel(cosine, GlassIor);
            float twice = 2.0 * once / (1.0 + once);
            glass = twice * reflection(Normal) + ((1.0 - twice) * Tint) * refraction(Normal, 1.0);
        }
        surface = (1.0 - GlassShare) * surface + GlassShare * glass;
    }
    Surface = Opacity * surface + (1.0 - Opacity) * transparent();
}
"""


def write(path):
    parts = {"table": TABLE, "means": MEANS, "ramps": ramps(STOPS)}
    lists = {name: ", ".join(f"{value:.7g}" for value in part.ravel()) for name, part in parts.items()}
    sizes = {f"{name}_size": part.size for name, part in parts.items()}
    with open(path, "w", encoding="utf-8") as file:
        file.write(TEXT % (lists | sizes | {"roughnesses": ROUGHNESSES, "cosines": COSINES, "stops": STOPS}))
