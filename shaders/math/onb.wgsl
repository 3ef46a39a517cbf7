// An orthonormal basis around a unit vector, without loss of precision anywhere on the sphere.
// Source: Duff et al., Building an Orthonormal Basis, Revisited, JCGT 6(1), 2017.

struct Frame {
    tangent: vec3f,
    bitangent: vec3f,
    normal: vec3f,
}

fn frame_around(normal: vec3f) -> Frame {
    let s = select(-1.0, 1.0, normal.z >= 0.0);
    let a = -1.0 / (s + normal.z);
    let b = normal.x * normal.y * a;
    let tangent = vec3f(1.0 + s * normal.x * normal.x * a, s * b, -s * normal.x);
    let bitangent = vec3f(b, s + normal.y * normal.y * a, -normal.y);
    return Frame(tangent, bitangent, normal);
}

fn to_local(frame: Frame, v: vec3f) -> vec3f {
    return vec3f(dot(v, frame.tangent), dot(v, frame.bitangent), dot(v, frame.normal));
}

fn to_world(frame: Frame, v: vec3f) -> vec3f {
    return frame.tangent * v.x + frame.bitangent * v.y + frame.normal * v.z;
}
