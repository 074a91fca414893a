#include "lib/view.glsl"
#include "lib/surface.glsl"
#include "lib/cutout.glsl"
#include "lib/detail.glsl"
#include "lib/material.glsl"
#include "lib/render_space.glsl"
#ifdef TEXTURES
#include "lib/texture.glsl"
#endif
#include "generated/planes.glsl"

in vec3 normal_relative;
in vec4 display_color;
flat in uint material_index;
flat in uint instance_index;
flat in float handedness;
#ifdef PLANE_LINKS
flat in uint link_set;
#endif
#ifdef POSITION
in vec3 position_relative;
#endif
#ifdef TEXTURES
in vec4 uv;
#endif
#ifdef LAYER_UV
in vec2 layer_uv;
#endif
#ifdef PRIMVARS
in mat4 primvars;
#endif
#ifdef MOTION
in vec4 clip_before;
in vec4 clip_now;
in vec4 clip_after;
#endif
#ifdef DRAW_ROW
flat in uint visible_row;
#endif

Surface surface_of(Material material, vec3 normal) {
    Surface s;
    s.normal = normal;
#ifdef PLANE_LINKS
    s.link_set = link_set;
#endif
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

// Before any branch, because of the derivatives.
Detail detail_of(vec3 normal) {
    Detail d;
#ifdef PLANE_FACET
    d.facet = facet_normal(dFdx(position_relative), dFdy(position_relative));
#endif
#ifdef LAYER_UV
    d.uv = layer_uv;
#endif
#ifdef PLANE_TANGENT
    Coordinates c = Coordinates(layer_uv, dFdx(layer_uv), dFdy(layer_uv));
    d.tangent = tangent_across(normal, along_coordinates(dFdx(position_relative), dFdy(position_relative), c)[0]);
#endif
#ifdef PRIMVARS
    d.primvars = primvars;
#endif
#ifdef PLANE_MOTION
    d.motion = vec4(pixels_between(clip_now, clip_before, view.size), pixels_between(clip_now, clip_after, view.size));
#endif
#ifdef PLANE_VISIBLE
    d.visible = uvec2(visible_row + 1u, uint(gl_PrimitiveID));
#endif
    return d;
}

void main() {
    Material material = material_at(material_index, display_color);
    float side = gl_FrontFacing ? handedness : -handedness;
    vec3 normal = normalize(normal_relative);
    Detail detail = detail_of(normal);
#ifdef TEXTURES
    apply_textures(material, normal, position_relative, uv);
#endif
#ifdef CUTOUT
    if (is_cut_out(material, instance_index) || (material.one_sided != 0u && side < 0.0)) discard;
#endif
    detail.occlusion = material.occlusion;
    write_planes(surface_of(material, side * normal), detail);
}
