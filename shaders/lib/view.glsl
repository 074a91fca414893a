#include "lib/records.glsl"

layout(std430, binding = 0) readonly buffer ViewBlock { View view; };

// Unit vector from a relative position to the eye.
vec3 direction_to_eye(vec3 position) {
#ifdef ORTHOGRAPHIC
    return normalize(view.relative_from_camera[2].xyz);
#else
    return normalize(view.relative_from_camera[3].xyz - position);
#endif
}

// Planar camera depth of a stored depth.
float camera_depth(float stored) {
    float linear = view.depth_coefficients.x * stored + view.depth_coefficients.y;
#ifdef ORTHOGRAPHIC
    return linear;
#else
    return 1.0 / linear;
#endif
}

// The relative position that a pixel sees at a camera depth. `pixel` is in raster space, its centre at .5.
vec3 position_at(vec2 pixel, float depth) {
    vec2 t = pixel / view.size;
    vec2 p = vec2(mix(view.window.x, view.window.y, t.x), mix(view.window.w, view.window.z, t.y));
#ifdef ORTHOGRAPHIC
    vec3 position_camera = vec3(p, -depth);
#else
    vec3 position_camera = vec3(p * depth, -depth);
#endif
    return (view.relative_from_camera * vec4(position_camera, 1.0)).xyz;
}
