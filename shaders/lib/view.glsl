#include "lib/records.glsl"

layout(std140, binding = 2) uniform ViewBlock { View view; };

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
    vec3 ray = view.first + pixel.x * view.right + pixel.y * view.down;
#ifdef ORTHOGRAPHIC
    return view.relative_from_camera[3].xyz + ray - depth * view.relative_from_camera[2].xyz;
#else
    return view.relative_from_camera[3].xyz + depth * ray;
#endif
}
