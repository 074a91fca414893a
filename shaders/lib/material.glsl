#include "lib/records.glsl"

layout(std430, binding = 2) readonly buffer MaterialBlock { Material materials[]; };

// The material at a pixel before its textures: displayColor and displayOpacity stand in where it asks for them.
Material material_at(uint index, vec4 display_color) {
    Material material = materials[index];
    if (material.uses_display_color != 0u) material.diffuse_color = display_color.rgb;
    if (material.uses_display_opacity != 0u) material.opacity = display_color.a;
    return material;
}
