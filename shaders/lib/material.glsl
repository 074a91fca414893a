#include "lib/records.glsl"
#include "lib/render_space.glsl"
#include "lib/surface.glsl"

layout(std430, binding = 2) readonly buffer MaterialBlock { Material materials[]; };

// The material at a pixel before its textures: displayColor and displayOpacity stand in where it asks for them.
Material with_display(Material material, vec4 display_color) {
    if (material.uses_display_color != 0u) material.diffuse_color = display_color.rgb;
    if (material.uses_display_opacity != 0u) material.opacity = display_color.a;
    return material;
}

Surface surface_of(Material material, vec3 normal) {
    Surface s;
    s.normal = normal;
    s.base = render_from_rec709(material.diffuse_color);
    s.metallic = material.metallic;
    s.roughness = material.roughness;
    s.emission = render_from_rec709(material.emissive_color);
    s.clearcoat = material.clearcoat;
    s.clearcoat_roughness = material.clearcoat_roughness;
    set_metallic_fresnel(s, F0_from_ior(material.ior));
    if (material.use_specular_workflow != 0u) {
        s.metallic = 0.0;
        s.f0 = render_from_rec709(material.specular_color);
        s.f90 = vec3(1.0);
    }
    return s;
}
