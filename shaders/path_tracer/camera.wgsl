// Rays of pinhole and parallel cameras. Offsets count from the middle of the image in whole half-pixels, which are exact, so that
// neither the position in the pixel nor the direction loses digits to a large pixel index.

import package::path_tracer::scene_access::view;

const PROJECTION_PERSPECTIVE: u32 = 0u;

struct CameraRay {
    origin: vec3f,
    direction: vec3f,
}

// `jitter` in 0..1 is the place within the pixel, x to the right and y down.
fn camera_ray(pixel: vec2u, jitter: vec2f) -> CameraRay {
    let half_pixels = vec2i(2u * pixel + 1u) - vec2i(vec2u(view.width, view.height));
    let offset = 0.5 * vec2f(half_pixels) + (jitter - 0.5);
    let sideways = view.camera_right * offset.x - view.camera_up * offset.y;
    if view.projection == PROJECTION_PERSPECTIVE {
        return CameraRay(view.camera_origin, normalize(view.camera_forward + sideways));
    }
    return CameraRay(view.camera_origin + sideways, view.camera_forward);
}
