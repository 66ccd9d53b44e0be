// Bodies as a point sees them: the planes and frames in which their silhouettes are drawn. Twin of src/kernel/body.rs, which
// explains them, and of facing_images in src/backend/gather.rs.

// Whether any light is a sphere or a tube.
override BODIES: bool = true;

// Kinds of emitter: whole bodies; and from FORM_FACING_SPHERE on those that turn to the point, the silhouettes of a sphere
// and of a tube's side, and what the rim of a tube's end adds to the side or hides of it.
const FORM_SPHERE: u32 = 3u;
const FORM_TUBE: u32 = 4u;
const FORM_FACING_SPHERE: u32 = 5u;
const FORM_SIDE: u32 = 6u;
const FORM_END: u32 = 7u;

// Whether the emitter is a body, which has no back.
fn is_whole(emitter: Emitter) -> bool {
    return BODIES && (emitter.form == FORM_SPHERE || emitter.form == FORM_TUBE);
}

// The images of an emitter that turns to the point; its front is 0 where the emitter does not reach there.
fn body_images(shading: ShadingFrame, emitter: Emitter, position: vec3f) -> Images {
    let to_center = emitter.center - position;
    let largest = max(abs(emitter.x) * max(1.0, max(emitter.radius, abs(emitter.length))), abs(to_center));
    let unit = power_of_two_unit(max(largest.x, max(largest.y, largest.z)));
    let center = to_center * unit;
    let x = emitter.x * unit;
    if emitter.form == FORM_FACING_SPHERE {
        return facing_disc(shading, emitter, center, length(x));
    }
    return facing_tube(shading, emitter, center, x);
}

// The facing disc of a sphere whose centre is at `center`; `half` is half the side of its square.
fn facing_disc(shading: ShadingFrame, emitter: Emitter, center: vec3f, half: f32) -> Images {
    var images: Images;
    images.sign = 1.0;
    let radius = emitter.radius * half;
    let distance = length(center);
    if !(distance > radius) {
        return images;
    }
    let normal = -center / distance;
    let x = any_orthonormal_vector(normal);
    let nearer = sqrt((distance - radius) * (distance + radius));
    images.x = to_local(shading, x * half);
    images.y = to_local(shading, cross(normal, x) * half);
    images.center = to_local(shading, normal * -nearer);
    images.normal = to_local(shading, normal * (half * half));
    images.front = half * half * nearer;
    return images;
}

// A face of a tube whose middle is at `center`; `half_x` is the image of its square's x axis.
fn facing_tube(shading: ShadingFrame, emitter: Emitter, center: vec3f, half_x: vec3f) -> Images {
    var images: Images;
    images.sign = 1.0;
    let half = length(half_x);
    let axis = half_x / half;
    let radius = emitter.radius * half;
    let along = -dot(center, axis);
    let across = -center - axis * along;
    let rho = length(across);
    if !(rho > radius) {
        return images;
    }
    let normal = across / rho;
    let seen = (rho - radius) * (rho + radius);
    let width = radius / rho * sqrt(seen);
    let distance = seen / rho;
    var x = half_x;
    var y = cross(normal, axis) * (width / emitter.radius);
    var middle = axis * -along - normal * distance;
    var area = half * width / emitter.radius;
    if emitter.form == FORM_END {
        let outward = sign(emitter.length);
        let beyond = emitter.length * half - along;
        let height = beyond * radius / rho;
        x = cross(axis, normal) * (outward * width / emitter.radius);
        y = axis * (height / emitter.radius);
        middle = axis * (beyond + height * 0.5) - normal * distance;
        area = outward * width * height / (emitter.radius * emitter.radius);
        images.sign = select(1.0, -1.0, area < 0.0);
    }
    images.x = to_local(shading, x);
    images.y = to_local(shading, y);
    images.center = to_local(shading, middle);
    // x × y, which runs along the normal for all of them.
    images.normal = to_local(shading, normal * area);
    images.front = area * distance;
    return images;
}
