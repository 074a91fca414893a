#include "lib/view.glsl"
#include "lib/material.glsl"

layout(std430, binding = 1) readonly buffer InstanceBlock { Instance instances[]; };

in vec3 position_object;
in vec3 normal_object;
#ifdef DISPLAY_COLOR_VARIES
in vec4 vertex_color;          // alpha is opacity; negative: the instance's value counts
#endif
#ifdef TEXTURES
#include "lib/uv_type.glsl"
in UvSets vertex_uv;
#endif
#ifdef LAYER_UV
in vec2 vertex_layer_uv;
out vec2 layer_uv;
#endif
#ifdef PRIMVARS
in mat4 vertex_primvars;
out mat4 primvars;
#endif
#ifdef MOTION
layout(std430, binding = 8) readonly buffer MotionBlock { Motion motions[]; };
in vec3 position_before;
in vec3 position_after;
out vec4 clip_before;
out vec4 clip_now;
out vec4 clip_after;
#endif
#ifdef CLIPPING_PLANES
uniform vec4 clipping_planes[CLIPPING_PLANES];   // relative space; what has a negative distance is not seen
out float gl_ClipDistance[CLIPPING_PLANES];
#endif
#ifdef DRAW_ROW
in uint draw_row;
flat out uint visible_row;
#endif
in uvec2 draw;                 // instance, material

out vec3 normal_relative;
#ifdef DISPLAY_COLOR_VARIES
out vec4 display_color;
#endif
flat out Material authored;    // a software rasteriser fetches it faster here than at each pixel
flat out uint material_index;
flat out uint instance_index;
flat out float handedness;
#ifdef PLANE_LINKS
flat out uint link_set;
#endif
#ifdef POSITION
out vec3 position_relative;
#endif
#ifdef TEXTURES
out UvSets uv;
#endif

void main() {
    Instance instance = instances[draw.x];
    vec4 position = instance.relative_from_object * vec4(position_object, 1.0);
    normal_relative = mat3(instance.relative_from_normal) * normal_object;
    instance_index = draw.x;
    material_index = draw.y;
    vec4 display = vec4(instance.display_color, instance.display_opacity);
#ifdef DISPLAY_COLOR_VARIES
    if (vertex_color.r >= 0.0) display.rgb = vertex_color.rgb;
    if (vertex_color.a >= 0.0) display.a = vertex_color.a;
    display_color = display;
    authored = materials[draw.y];
#else
    authored = with_display(materials[draw.y], display);
#endif
    handedness = instance.handedness;
#ifdef PLANE_LINKS
    link_set = instance.link_set;
#endif
#ifdef POSITION
    position_relative = position.xyz;
#endif
#ifdef TEXTURES
    uv = vertex_uv;
#endif
#ifdef LAYER_UV
    layer_uv = vertex_layer_uv;
#endif
#ifdef PRIMVARS
    primvars = vertex_primvars;
#endif
#ifdef MOTION
    Motion motion = motions[draw.x];
    clip_before = motion.clip_before_from_object * vec4(position_before, 1.0);
    clip_now = motion.clip_now_from_object * vec4(position_object, 1.0);
    clip_after = motion.clip_after_from_object * vec4(position_after, 1.0);
#endif
#ifdef DRAW_ROW
    visible_row = draw_row;
#endif
#ifdef CLIPPING_PLANES
    for (int i = 0; i < CLIPPING_PLANES; ++i) gl_ClipDistance[i] = dot(clipping_planes[i], vec4(position.xyz, 1.0));
#endif
    gl_Position = view.clip_from_relative * vec4(position.xyz, 1.0);
}
