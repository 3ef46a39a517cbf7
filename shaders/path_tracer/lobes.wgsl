// The lobes of a surface, one material or a tree of several, as the host has flattened it (`gpu_scene::lobes`).
//
// Light is the sum of all lobes by their shares. One lobe is drawn in whole 65536ths, by its share and by how much it reflects; the density of a
// direction is that of all lobes together, each in its own frame, so that light sampling can weigh it.
//
// A material that is no tree is a list of one lobe here: compilers write out every call, and one way through is half the code of two.

import constants::{TREE_LOBES, TREE_TABLE};
import package::math::fresnel::fresnel_dielectric;
import package::math::mis::PDF_MIN;
@if(normal_maps) import package::math::onb::Frame;
import package::math::onb::{to_local, to_world};
import package::path_tracer::bsdf::{Bsdf, BsdfValue, FramedSample, bsdf_strength, choose_lobes, evaluate_bsdf, sample_bsdf};
import package::path_tracer::lobe_choice::ticks_to_probability;
import package::path_tracer::material_bsdf::bsdf_at;
import package::path_tracer::records::{Lobe, Material, LOBE_ROWS, TERM_CUSTOM, TERM_FRESNEL, TERM_REST, TERM_ROWS, unpack_lobe, unpack_term};
import package::path_tracer::scene_access::{Triangle, load_material, table_row, table_word};
import package::path_tracer::surface::Surface;
@if(normal_maps) import package::path_tracer::surface::shading_frame;
@if(textures) import package::path_tracer::records::NONE;
@if(textures) import package::path_tracer::texture::{sample_texture, texture_coordinates};

// A lobe that reflects next to nothing is drawn as often as one that reflects this much.
const STRENGTH_MIN: f32 = 0.03125;

// Those lobes that can contribute, at one point and for one direction of view.
struct Lobes {
    count: u32,
    // Draws out of 65536; at least one.
    ticks: array<u32, TREE_LOBES>,
    shares: array<f32, TREE_LOBES>,
    bsdfs: array<Bsdf, TREE_LOBES>,
    // Each leaf follows its own normal map, or none.
    @if(normal_maps) frames: array<Frame, TREE_LOBES>,
}

// At least one, also of a material that is no tree.
fn tree_lobe_count(material: Material) -> u32 {
    if material.tree == 0u {
        return 1u;
    }
    return table_word(TREE_TABLE + material.tree - 1u, 0u);
}

// Cosine of the view against the normal that the curves follow.
fn lobe_share(lobe: Lobe, triangle: Triangle, barycentrics: vec2f, cosine: f32) -> f32 {
    var share = lobe.factor;
    for (var index = 0u; index < lobe.term_count; index += 1u) {
        let at = TREE_TABLE + lobe.terms + index * TERM_ROWS;
        let term = unpack_term(table_row(at), table_row(at + 1u));
        let curve = term.kind & ~TERM_REST;
        var taken = term.weight;
        if curve == TERM_FRESNEL {
            taken *= fresnel_dielectric(cosine, term.start);
        }
        if curve == TERM_CUSTOM {
            let fall = clamp(1.0 - cosine, 0.0, 1.0);
            let rise = select(pow(fall, term.exponent), 0.0, fall == 0.0);
            taken *= term.start + (term.grazing - term.start) * rise;
        }
        @if(textures) if term.texture != NONE {
            taken *= sample_texture(term.texture, texture_coordinates(triangle.vertices, barycentrics), false).x;
        }
        share *= select(taken, 1.0 - taken, (term.kind & TERM_REST) != 0u);
    }
    return share;
}

fn lobes_at(lobes: ptr<function, Lobes>, triangle: Triangle, material: Material, barycentrics: vec2f, surface: Surface, wo: vec3f) {
    var weights: array<f32, TREE_LOBES>;
    var total = 0.0;
    var count = 0u;
    let cosine = to_local(surface.frame, wo).z;
    let listed = tree_lobe_count(material);
    for (var index = 0u; index < listed; index += 1u) {
        var leaf = material;
        var share = 1.0;
        if material.tree != 0u {
            let lobe = unpack_lobe(table_row(TREE_TABLE + material.tree + index * LOBE_ROWS));
            share = lobe_share(lobe, triangle, barycentrics, cosine);
            leaf = load_material(lobe.material);
        }
        let bsdf = bsdf_at(triangle, leaf, barycentrics, surface.is_front);
        var frame = surface.frame;
        @if(normal_maps) frame = shading_frame(triangle, leaf, barycentrics, surface.normal, surface.is_front, wo);
        let strength = bsdf_strength(bsdf, to_local(frame, wo));
        if share > 0.0 && strength > 0.0 {
            weights[count] = share * max(strength, STRENGTH_MIN);
            total += weights[count];
            (*lobes).shares[count] = share;
            (*lobes).bsdfs[count] = bsdf;
            @if(normal_maps) (*lobes).frames[count] = frame;
            count += 1u;
        }
    }
    (*lobes).count = count;
    // One draw for everybody, and the others in proportion; rounding up to a common end, so that all 65536 are given away.
    let free = 65536u - count;
    var sum = 0.0;
    var given = 0u;
    for (var index = 0u; index < count; index += 1u) {
        sum += weights[index];
        let end = max(given, select(u32(sum / total * f32(free) + 0.5), free, sum >= total));
        (*lobes).ticks[index] = end - given + 1u;
        given = end;
    }
}

// All that light sampling can find; `wi` lies above the true plane.
fn evaluate_tree(lobes: ptr<function, Lobes>, surface: Surface, wo: vec3f, wi: vec3f) -> BsdfValue {
    var sum = BsdfValue(vec3f(0.0), 0.0);
    for (var index = 0u; index < (*lobes).count; index += 1u) {
        let bsdf = (*lobes).bsdfs[index];
        var frame = surface.frame;
        @if(normal_maps) frame = (*lobes).frames[index];
        let local = to_local(frame, wo);
        let value = evaluate_bsdf(bsdf, choose_lobes(bsdf, local), local, to_local(frame, wi));
        sum.f_cosine += (*lobes).shares[index] * value.f_cosine;
        sum.pdf += ticks_to_probability((*lobes).ticks[index]) * value.pdf;
    }
    return sum;
}

// The direction is that of one lobe, in its frame; the weight and the density are those of all lobes. `words`: as sample_bsdf has them, and w
// chooses the lobe of the tree.
fn sample_tree(lobes: ptr<function, Lobes>, surface: Surface, wo: vec3f, words: vec4u) -> FramedSample {
    let word = words.w >> 16u;
    var chosen = 0u;
    var end = (*lobes).ticks[0];
    while word >= end && chosen + 1u < (*lobes).count {
        chosen += 1u;
        end += (*lobes).ticks[chosen];
    }
    var frame = surface.frame;
    @if(normal_maps) frame = (*lobes).frames[chosen];
    var drawn = sample_bsdf((*lobes).bsdfs[chosen], to_local(frame, wo), words);
    // The only lobe knows its weight.
    let is_alone = (*lobes).count < 2u;
    if is_alone || drawn.pdf == 0.0 {
        let scale = (*lobes).shares[chosen] / ticks_to_probability((*lobes).ticks[chosen]);
        drawn.weight = select(drawn.weight * scale, vec3f(0.0), (*lobes).count == 0u);
        return FramedSample(drawn, frame);
    }
    let value = evaluate_tree(lobes, surface, wo, normalize(to_world(frame, drawn.wi)));
    drawn.weight = select(value.f_cosine / value.pdf, vec3f(0.0), value.pdf < PDF_MIN);
    drawn.pdf = value.pdf;
    return FramedSample(drawn, frame);
}
