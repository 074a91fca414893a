#include "lib/records.glsl"

layout(std430, binding = 1) readonly buffer InstanceBlock { Instance instances[]; };

#ifdef LINKS
#include "lib/linking.glsl"

uniform uint first_caster;     // bits of the link sets that cast
#endif
uniform mat4 clip_from_relative;

in vec3 position_object;
in uvec2 draw;                 // instance, material
#ifdef CUTOUT
#ifdef DISPLAY_COLOR_VARIES
in vec4 vertex_color;
#endif
#ifdef TEXTURES
#include "lib/uv_type.glsl"
in UvSets vertex_uv;
out UvSets uv;
#endif
out vec4 display_color;
flat out uint material_index;
flat out uint instance_index;
#ifdef TRANSPARENT
in vec3 normal_object;
out vec3 position_relative;
out vec3 normal_relative;
#endif
#endif

void main() {
    Instance instance = instances[draw.x];
    vec4 position = instance.relative_from_object * vec4(position_object, 1.0);
    gl_Position = clip_from_relative * vec4(position.xyz, 1.0);
#ifdef LINKS
    if (!is_linked(first_caster, instance.link_set)) gl_Position = vec4(2.0, 2.0, 2.0, 1.0); // nowhere in the map
#endif
#ifdef CUTOUT
    instance_index = draw.x;
    material_index = draw.y;
#ifdef TEXTURES
    uv = vertex_uv;
#endif
    display_color = vec4(instance.display_color, instance.display_opacity);
#ifdef DISPLAY_COLOR_VARIES
    if (vertex_color.r >= 0.0) display_color.rgb = vertex_color.rgb;
    if (vertex_color.a >= 0.0) display_color.a = vertex_color.a;
#endif
#ifdef TRANSPARENT
    position_relative = position.xyz;
    normal_relative = mat3(instance.relative_from_normal) * normal_object;
#endif
#endif
}
