// Where a ray meets lamps, and what one of the points that stand for them bears there: defshade_cli/scene/lamp.py.
#include "lib/light.glsl"

layout(std430, binding = 11) readonly buffer LampBlock { Lamp lamps[]; };
layout(std430, binding = 12) readonly buffer CellBlock { vec4 lamp_cells[]; };

const uint BALL = 0u, SPHERE = 1u, DISK = 2u, RECT = 3u, CYLINDER = 4u, CONE = 5u;
const float FAR_AWAY = 3.0e38;

struct LampHit {
    float distance;
    float solid_angle;         // that one of the lamp's points stands for; 0 where the ray misses it
    vec3 tint;                 // of its radiance
};

const LampHit MISSED = LampHit(0.0, 0.0, vec3(1.0));

LampHit meets_ball(Lamp lamp, vec3 to_centre, float along, float aside_squared, vec3 l) {
    float entry = max(along - sqrt(lamp.radius * lamp.radius - aside_squared), 0.0);
    return LampHit(entry, ball_solid_angle(lamp.area, lamp.radius, to_centre, l), vec3(1.0));
}

void show_cell(Lamp lamp, vec2 at, inout LampHit hit) {
    uvec2 cell = min(uvec2((0.5 - 0.5 * at) * vec2(lamp.cells)), lamp.cells - 1u);
    vec4 shown = lamp_cells[lamp.first_cell + cell.y * lamp.cells.x + cell.x];
    hit.tint = shown.rgb;
    hit.solid_angle = shown.a > 0.0 ? hit.solid_angle / shown.a : 0.0;
}

// Surfaces, which shine outwards, or along -Z. A patch of the lamp's own space has a solid angle of its area times `stretch` times
// the own-space cosine over the squared distance, for the cofactors of a map take areas to areas.
LampHit meets_surface(Lamp lamp, vec3 position, vec3 l) {
    mat4x3 lamp_from_relative = transpose(mat3x4(lamp.x, lamp.y, lamp.z));
    vec3 o = lamp_from_relative * vec4(position, 1.0), d = lamp_from_relative * vec4(l, 0.0);
    float t, facing;
    if (lamp.shape == DISK || lamp.shape == RECT) {
        facing = d.z;
        t = -o.z / d.z;
    } else {
        vec3 across = lamp.shape == CYLINDER ? vec3(0.0, 1.0, 1.0) : vec3(1.0);
        float a = dot(d, across * d), b = dot(o, across * d), c = dot(o, across * o) - 1.0;
        facing = sqrt(max(b * b - a * c, 0.0));
        t = -(b + facing) / a;
    }
    if (!(facing > 0.0 && t > 0.0)) return MISSED;
    vec3 at = o + t * d;
    if (lamp.shape == DISK && dot(at.xy, at.xy) > 1.0) return MISSED;
    if (lamp.shape == RECT && max(abs(at.x), abs(at.y)) > 1.0) return MISSED;
    if (lamp.shape == CYLINDER && abs(at.x) > 1.0) return MISSED;
    LampHit hit = LampHit(t, lamp.area * lamp.stretch * facing / (t * t), vec3(1.0));
    if (lamp.shape == CYLINDER) hit.solid_angle /= 1.0 + dot(lamp.bias, at.yz);
    if (lamp.cells.x > 0u) show_cell(lamp, at.xy, hit);
    return hit;
}

LampHit meets_lamp(Lamp lamp, Light light, vec3 position, vec3 l) {
    if (lamp.shape == CONE) {
        vec3 apart = l + light.axis;
        return LampHit(FAR_AWAY, dot(apart, apart) <= lamp.radius * lamp.radius ? lamp.area : 0.0, vec3(1.0));
    }
    vec3 to_centre = lamp.centre - position, aside = cross(to_centre, l);
    float along = dot(to_centre, l), aside_squared = dot(aside, aside);
    if (dot(to_centre, to_centre) >= (light.reach + lamp.radius) * (light.reach + lamp.radius)) return MISSED;
    if (along < -lamp.radius || aside_squared >= lamp.radius * lamp.radius) return MISSED;
    if (lamp.shape != BALL) return meets_surface(lamp, position, l);
    return along > 0.0 ? meets_ball(lamp, to_centre, along, aside_squared, l) : MISSED;
}
