#include "lib/tangent.glsl"

// What only layers show of a pixel. Members whose plane is not there are not set.
struct Detail {
    vec3 facet;                // unit, facing the camera
    vec3 tangent;              // unit, or 0
    vec2 uv;
    float occlusion;
    mat4 primvars;             // four at most, a column each
    vec4 motion;               // pixels, y up: to where it was a frame before, to where it is a frame later
    uvec2 visible;             // 1 + row of the draw list, triangle of its command; (0, 0) is the background
};

// From one place in the image to another, in pixels, y up; 0 where one is behind the camera.
vec2 pixels_between(vec4 here, vec4 there, vec2 size) {
    if (min(here.w, there.w) <= 0.0) return vec2(0.0);
    return 0.5 * size * (there.xy / there.w - here.xy / here.w);
}

// Normal of the triangle. Pixels run right and down, so what is seen always turns the same way.
vec3 facet_normal(vec3 dPdx, vec3 dPdy) {
    vec3 n = cross(dPdy, dPdx);
    return dot(n, n) == 0.0 ? vec3(0.0) : normalize(n);
}
