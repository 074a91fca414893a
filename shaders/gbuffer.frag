#include "lib/view.glsl"
#include "lib/surface.glsl"
#include "lib/cutout.glsl"
#include "lib/detail.glsl"
#include "lib/material.glsl"
#ifdef TEXTURES
#include "lib/texture.glsl"
#endif
#include "generated/planes.glsl"

in vec3 normal_relative;
#ifdef DISPLAY_COLOR_VARIES
in vec4 display_color;
#endif
flat in Material authored;
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
in UvSets uv;
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

// Before any branch, because of the derivatives.
Detail detail_of(vec3 normal) {
    Detail d;
#if defined(PLANE_FACET) || defined(PLANE_TRIANGLE)
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

float cosine_to_eye(vec3 normal) {
#ifdef TRANSPARENT
    return max(dot(normal, direction_to_eye(position_relative)), MIN_NOV);
#else
    return 1.0;
#endif
}

// The interpolated normal; where opposite ones cancel out, against the view.
vec3 unit_normal(float side) {
    float length_squared = dot(normal_relative, normal_relative);
    return length_squared > 0.0 ? normalize(normal_relative) : side * view.relative_from_camera[2].xyz;
}

void main() {
    Material material = authored;
#ifdef DISPLAY_COLOR_VARIES
    material = with_display(material, display_color);
#endif
    float side = gl_FrontFacing ? handedness : -handedness;
    vec3 normal = unit_normal(side);
    Detail detail = detail_of(normal);
#ifdef TEXTURES
    apply_textures(material, normal, position_relative, uv);
#endif
#ifdef PLANE_WEIGHTS
    float turn = turn_of(dFdx(normal), dFdy(normal));
#endif
    Surface surface = surface_of(material, side * normal);
#ifdef PLANE_LINKS
    surface.link_set = link_set;
#endif
#ifdef PLANE_WEIGHTS
    surface.weights = vec2(1.0);
    surface.turn = turn;
#endif
#ifdef CUTOUT
    float coverage = coverage_of(material, surface, cosine_to_eye(surface.normal));
    bool is_hidden = material.one_sided != 0u && side < 0.0;
    if (is_hidden || is_cut_out(coverage, instance_index, material_index)) discard;
#ifdef PLANE_WEIGHTS
    if (material.is_transparent != 0u) surface.weights = vec2(material.opacity, 1.0) / coverage;
#endif
#endif
    detail.occlusion = material.occlusion;
    write_planes(surface, detail);
}
