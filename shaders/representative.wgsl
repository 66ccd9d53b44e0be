// The representative point: a simple light seen as one direction of its own, chosen by the mirror ray. Twin of
// src/kernel/representative.rs, which says what is whose.
//
// Shading frame: z is the normal, the view direction v = (sin theta, 0, cos theta), the mirror direction
// r = (-sin theta, 0, cos theta). Only ratios of lengths count.
//
// This file depends on normalize_or_zero of horizon.wgsl and on the constants SOLID_RECTANGLE, SOLID_DISC, SOLID_SPHERE and
// SOLID_TUBE (u32), the kinds, which come from there.

// A light by its own axes, in its square.
struct Solid {
    center: vec2f,
    half: vec2f,
    kind: u32,
    // How much of it shines, 0..1: the part of its rectangle that a shape fills, by area.
    coverage: f32,
}

// A light as a shading point sees it, in the shading frame; units are immaterial.
struct Body {
    // Rectangle: half-sides x and y. Disc: half-axes x and y. Sphere: radius |x|. Tube: half its axis x, radius |y|.
    kind: u32,
    // Its middle, from the point.
    center: vec3f,
    x: vec3f,
    y: vec3f,
}

// One direction that stands for a light.
struct Representative {
    // Towards it, any length.
    direction: vec3f,
    // Solid angle of the light, sr.
    solid_angle: f32,
    // sqrt(solid angle/pi) of what the lobe is widened by on all sides; the rest of it widens it along one line.
    spread: f32,
}

// From the images of the square's middle and axes.
fn body_of(solid: Solid, middle: vec3f, x: vec3f, y: vec3f) -> Body {
    let center = middle + x * solid.center.x + y * solid.center.y;
    return Body(solid.kind, center, x * solid.half.x, y * solid.half.y);
}

fn length_squared(v: vec3f) -> f32 {
    return dot(v, v);
}

// The integral of the plain cosine: irradiance over pi*radiance, 1 for a full hemisphere, where the approximations end. 0
// inside a body.
fn body_diffuse(body: Body) -> f32 {
    return min(body_irradiance(body), 1.0);
}

fn body_irradiance(body: Body) -> f32 {
    if body.kind == SOLID_SPHERE {
        let d2 = length_squared(body.center);
        let r2 = length_squared(body.x);
        if r2 >= d2 {
            return 0.0;
        }
        return cap_irradiance(body.center.z / sqrt(d2), r2 / d2);
    }
    if body.kind == SOLID_DISC {
        return disc_irradiance(body.center, body.x, body.y);
    }
    if body.kind == SOLID_RECTANGLE {
        return rectangle_irradiance(body.center, body.x, body.y);
    }
    if is_inside_tube(body) {
        return 0.0;
    }
    let up = tube_up(body);
    var sum = rectangle_irradiance(body.center, body.x, tube_facing(body));
    for (var i = 0u; i < 2u; i++) {
        let end = select(body.x, -body.x, i == 1u);
        if dot(end, body.center + end) < 0.0 {
            sum += disc_irradiance(body.center + end, body.y, up);
        }
    }
    return sum;
}

// The integral of the specular lobe: that of f*cos without Fresnel over the light, over `magnitude`, which is that over
// all directions. For a mirror 1 where the light is seen. 0 inside a body.
fn body_specular(body: Body, alpha_any: f32, cos_theta: f32, magnitude: f32) -> f32 {
    let alpha = min(max(alpha_any, LTC_ALPHA_MIN), 1.0);
    let c = min(max(cos_theta, 0.0), 1.0);
    let view = vec3f(sqrt(1.0 - c * c), 0.0, c);
    let point = representative_point(body, vec3f(-view.x, 0.0, c));
    let length = length(point.direction);
    if !(length > 0.0) || !(point.solid_angle > 0.0) {
        return 0.0;
    }
    let light = point.direction / length;
    let half_way = normalize_or_zero(view + light);
    // 0 only between two opposite grazing directions, where f cos is 0 as well.
    let facing = max(dot(view, half_way), 1e-6);
    let round = widened(alpha, point.spread, facing);
    // Solid angle = pi*s*(s + long): 0 but for a tube.
    let long = max(point.solid_angle / (PI * point.spread) - point.spread, 0.0);
    let line = widened(alpha, point.spread + long, facing);
    let energy = alpha * alpha / (round * line);
    return brdf_cos(alpha, view, light, half_way) * point.solid_angle * energy / magnitude;
}

fn alike(direction: vec3f, solid_angle: f32) -> Representative {
    return Representative(direction, solid_angle, sqrt(solid_angle / PI));
}

// The direction nearest to the mirror ray, by the rule of each shape.
fn representative_point(body: Body, mirror: vec3f) -> Representative {
    if body.kind == SOLID_SPHERE {
        let d2 = length_squared(body.center);
        let r2 = length_squared(body.x);
        if r2 >= d2 {
            return Representative();
        }
        return alike(towards(body.center, sqrt(r2), mirror), cap_solid_angle(r2 / d2));
    }
    if body.kind == SOLID_DISC {
        var q = on_plane(body, mirror);
        q /= max(length(q), 1.0);
        return alike(body.center + body.x * q.x + body.y * q.y, disc_solid_angle(body.center, body.x, body.y));
    }
    if body.kind == SOLID_RECTANGLE {
        let q = clamp(on_plane(body, mirror), vec2f(-1.0), vec2f(1.0));
        return alike(body.center + body.x * q.x + body.y * q.y, rectangle_solid_angle(body.center, body.x, body.y));
    }
    if is_inside_tube(body) {
        return Representative();
    }
    // Karis 2013: the point of the axis with the least distance to the ray.
    let axis2 = length_squared(body.x);
    let along = dot(mirror, body.x);
    let slant = axis2 - along * along;
    let offset = dot(mirror, body.center) * along - dot(body.center, body.x);
    var t = 0.0;
    if slant > 1e-6 * axis2 {
        t = clamp(offset / slant, -1.0, 1.0);
    }
    let radius = length(body.y);
    let direction = towards(body.center + body.x * t, radius, mirror);
    let up = tube_up(body);
    var solid_angle = rectangle_solid_angle(body.center, body.x, tube_facing(body));
    for (var i = 0u; i < 2u; i++) {
        let end = select(body.x, -body.x, i == 1u);
        if dot(end, body.center + end) < 0.0 {
            solid_angle += disc_solid_angle(body.center + end, body.y, up);
        }
    }
    // The radius as seen from the nearest point of the axis.
    let s = clamp(-dot(body.center, body.x) / axis2, -1.0, 1.0);
    let nearest = length(body.center + body.x * s);
    let spread = min(radius / max(nearest, radius), sqrt(solid_angle / PI));
    return Representative(direction, solid_angle, spread);
}

// Where the ray from the point along `direction` meets the plane, in half-sides from the middle; where it does not, far off
// on the side that it goes to.
fn on_plane(body: Body, direction: vec3f) -> vec2f {
    let normal = cross(body.x, body.y);
    let depth = dot(normal, body.center);
    let fall = dot(normal, direction) * select(1.0, -1.0, depth < 0.0);
    var t = 1e4 * (length(body.center) + length(body.x) + length(body.y));
    if fall > 0.0 {
        t = min(abs(depth) / fall, t);
    }
    let offset = direction * t - body.center;
    return vec2f(dot(offset, body.x) / length_squared(body.x), dot(offset, body.y) / length_squared(body.y));
}

fn is_inside_tube(body: Body) -> bool {
    let axis2 = length_squared(body.x);
    let s = -dot(body.center, body.x) / axis2;
    let away = body.center + body.x * s;
    return abs(s) <= 1.0 && length_squared(away) <= length_squared(body.y);
}

// The radius of a tube, square to its axis and to the direction to its middle; 0 for a point on the axis.
fn tube_facing(body: Body) -> vec3f {
    return normalize_or_zero(cross(body.x, body.center)) * length(body.y);
}

// The half-axis of a tube's caps that is square to y.
fn tube_up(body: Body) -> vec3f {
    return cross(body.x, body.y) / length(body.x);
}

// alpha' of a lobe widened by a light of spread s: alpha'^2 = alpha^2 + (alpha*s + s^2/4)/(v.h), at most 1. At v.h = 1 that
// is Karis' alpha' = alpha + s/2.
fn widened(alpha: f32, spread: f32, facing: f32) -> f32 {
    return sqrt(min(alpha * alpha + (alpha * spread + 0.25 * spread * spread) / facing, 1.0));
}

// The point of a sphere nearest to the mirror ray (Karis 2013, eq. 11).
fn towards(center: vec3f, radius: f32, mirror: vec3f) -> vec3f {
    let to_ray = mirror * max(dot(center, mirror), 0.0) - center;
    let distance = length(to_ray);
    return center + to_ray * select(1.0, radius / distance, distance > radius);
}

// cos*(1 + 2*Lambda), Heitz 2014 eq. 72 multiplied by the cosine.
fn smith(a2: f32, cos: f32) -> f32 {
    return sqrt(cos * cos + a2 * max(1.0 - cos * cos, 0.0));
}

// f(v, l)*cos of GGX with height-correlated Smith masking-shadowing and Fresnel = 1, 1/sr. `half_way` is the unit vector
// between `view` and `light`. 0 where `light` is below the horizon.
fn brdf_cos(alpha: f32, view: vec3f, light: vec3f, half_way: vec3f) -> f32 {
    if light.z <= 0.0 {
        return 0.0;
    }
    let a2 = alpha * alpha;
    let spread = half_way.x * half_way.x + half_way.y * half_way.y + a2 * half_way.z * half_way.z;
    let density = a2 / (PI * spread * spread);
    return density * light.z / (2.0 * (light.z * smith(a2, view.z) + view.z * smith(a2, light.z)));
}

// Solid angle of a spherical cap by sin^2 of its half-angle, which is below 90 degrees.
fn cap_solid_angle(sin2: f32) -> f32 {
    return 2.0 * PI * sin2 / (1.0 + sqrt(max(1.0 - sin2, 0.0)));
}

// Irradiance over pi*radiance of a spherical cap about a direction at `cos` from the normal, by sin^2 of its half-angle:
// exact, with the horizon (Lagarde 2014, listing 7).
fn cap_irradiance(cos: f32, sin2: f32) -> f32 {
    if cos * cos >= sin2 {
        return sin2 * max(cos, 0.0);
    }
    let sin = sqrt(max(1.0 - cos * cos, 1e-12));
    let x = sqrt(max(1.0 / sin2 - 1.0, 0.0));
    let y = clamp(-x * cos / sin, -1.0, 1.0);
    let root = sqrt(1.0 - y * y);
    let angle = atan2(root, y);
    let cut = sin2 * (cos * angle - x * sin * root) + atan2(sin * root, x);
    return max(cut / PI, 0.0);
}

// sin^2 of the half-angle of a disc that faces the point, and the cosine at the disc's own side.
fn right_disc(center: vec3f, x: vec3f, y: vec3f) -> vec2f {
    let d2 = length_squared(center);
    let normal = cross(x, y);
    let r2 = length(normal);
    if !(d2 > 0.0 && r2 > 0.0) {
        return vec2f();
    }
    return vec2f(r2 / (r2 + d2), min(abs(dot(normal, center)) / (r2 * sqrt(d2)), 1.0));
}

fn disc_solid_angle(center: vec3f, x: vec3f, y: vec3f) -> f32 {
    let disc = right_disc(center, x, y);
    return cap_solid_angle(disc.x) * disc.y;
}

fn disc_irradiance(center: vec3f, x: vec3f, y: vec3f) -> f32 {
    let disc = right_disc(center, x, y);
    if disc.y > 0.0 {
        return cap_irradiance(center.z / length(center), disc.x) * disc.y;
    }
    return 0.0;
}

// Solid angle of a rectangle: two triangles (van Oosterom, Strackee 1983), exact. The triple product is depth times area, so
// that a far light keeps its digits.
fn rectangle_solid_angle(center: vec3f, x: vec3f, y: vec3f) -> f32 {
    let volume = 4.0 * abs(dot(cross(x, y), center));
    if !(volume > 0.0) {
        return 0.0;
    }
    let a = center - x - y;
    let b = center + x - y;
    let c = center + x + y;
    let d = center - x + y;
    return triangle_angle(volume, a, b, c) + triangle_angle(volume, a, c, d);
}

fn triangle_angle(volume: f32, a: vec3f, b: vec3f, c: vec3f) -> f32 {
    let la = length(a);
    let lb = length(b);
    let lc = length(c);
    return 2.0 * atan2(volume, la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
}

fn clamped_cosine(p: vec3f) -> f32 {
    return max(p.z / max(length(p), 1e-37), 0.0);
}

fn rectangle_irradiance(center: vec3f, x: vec3f, y: vec3f) -> f32 {
    let below = clamped_cosine(center - x - y) + clamped_cosine(center + x - y);
    let above = clamped_cosine(center + x + y) + clamped_cosine(center - x + y);
    let mean = 0.2 * (below + above + clamped_cosine(center));
    return rectangle_solid_angle(center, x, y) * mean / PI;
}
