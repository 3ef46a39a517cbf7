// Looking into images with our own filter: hardware filters round their weights to a few bits.

import constants::VERTEX_ROWS;
@if(vertex_colors) import constants::VERTEX_COLOR_ROW;
@if(textures) import constants::VERTEX_UV_ROW;
import package::path_tracer::records::Material;
@if(textures) import package::path_tracer::records::{Texture, NONE, TEXTURE_LINEAR, TEXTURE_SECOND_UV, TEXTURE_WRAP_U_SHIFT, TEXTURE_WRAP_V_SHIFT};
import package::path_tracer::scene_access::{triangle_row, view};
@if(textures) import package::path_tracer::scene_access::{load_texture, texels};

// One row of the attributes of three vertices, interpolated.
fn interpolate_row(vertices: vec3u, row: u32, barycentrics: vec2f) -> vec4f {
    let at = view.vertices + vertices * VERTEX_ROWS + row;
    let a = bitcast<vec4f>(triangle_row(at.x));
    let b = bitcast<vec4f>(triangle_row(at.y));
    let c = bitcast<vec4f>(triangle_row(at.z));
    return a + (b - a) * barycentrics.x + (c - a) * barycentrics.y;
}

// A texel index inside the image: 0 repeats, 1 mirrors, 2 continues the border.
@if(textures) fn wrap_index(index: i32, size: i32, mode: u32) -> u32 {
    if mode == 2u {
        return u32(clamp(index, 0, size - 1));
    }
    let period = select(size, 2 * size, mode == 1u);
    var i = index % period;
    i = select(i, i + period, i < 0);
    return u32(select(i, period - 1 - i, i >= size));
}

// One texel; colours are decoded from sRGB by a table of exact values, alpha is linear.
@if(textures) fn fetch_texel(texture: Texture, x: u32, y: u32, is_color: bool) -> vec4f {
    let word = texels[texture.texels + y * texture.width + x];
    let bytes = vec4u(word, word >> 8u, word >> 16u, word >> 24u) & vec4u(255u);
    if !is_color {
        return vec4f(bytes) / 255.0;
    }
    let table = view.srgb_decoding + bytes.xyz;
    let rgb = vec3u(texels[table.x], texels[table.y], texels[table.z]);
    return vec4f(bitcast<vec3f>(rgb), f32(bytes.w) / 255.0);
}

// The value at texture coordinates; `uv` holds both sets.
@if(textures) fn sample_texture(index: u32, uv: vec4f, is_color: bool) -> vec4f {
    let texture = load_texture(index);
    let chosen = select(uv.xy, uv.zw, (texture.flags & TEXTURE_SECOND_UV) != 0u);
    let place = vec2f(dot(texture.row_u, vec3f(chosen, 1.0)), dot(texture.row_v, vec3f(chosen, 1.0)));
    let mode = vec2u(texture.flags >> TEXTURE_WRAP_U_SHIFT, texture.flags >> TEXTURE_WRAP_V_SHIFT) & vec2u(3u);
    // Reduced by whole periods first, so that large coordinates become indices that fit.
    let periodic = place - 2.0 * floor(place * 0.5);
    let reduced = select(periodic, clamp(place, vec2f(-1.0), vec2f(2.0)), mode == vec2u(2u));
    let size = vec2i(vec2u(texture.width, texture.height));
    let linear = (texture.flags & TEXTURE_LINEAR) != 0u;
    let scaled = reduced * vec2f(size) - select(0.0, 0.5, linear);
    let low = vec2i(floor(scaled));
    let x0 = wrap_index(low.x, size.x, mode.x);
    let y0 = wrap_index(low.y, size.y, mode.y);
    let t00 = fetch_texel(texture, x0, y0, is_color);
    if !linear {
        return t00;
    }
    let weight = scaled - floor(scaled);
    let x1 = wrap_index(low.x + 1, size.x, mode.x);
    let y1 = wrap_index(low.y + 1, size.y, mode.y);
    let t10 = fetch_texel(texture, x1, y0, is_color);
    let t01 = fetch_texel(texture, x0, y1, is_color);
    let t11 = fetch_texel(texture, x1, y1, is_color);
    let top = t00 + (t10 - t00) * weight.x;
    let bottom = t01 + (t11 - t01) * weight.x;
    return top + (bottom - top) * weight.y;
}

// Texture coordinates of a point on a triangle, both sets.
@if(textures) fn texture_coordinates(vertices: vec3u, barycentrics: vec2f) -> vec4f {
    return interpolate_row(vertices, VERTEX_UV_ROW, barycentrics);
}

// Base colour and alpha with texture and vertex colour multiplied in.
fn base_color_at(material: Material, vertices: vec3u, barycentrics: vec2f) -> vec4f {
    var color = material.base_color;
    @if(textures) if material.base_color_texture != NONE {
        color *= sample_texture(material.base_color_texture, texture_coordinates(vertices, barycentrics), true);
    }
    @if(vertex_colors) color *= interpolate_row(vertices, VERTEX_COLOR_ROW, barycentrics);
    return color;
}
