#include "lib/records.glsl"
#include "lib/tangent.glsl"
#include "lib/uv.glsl"
#include "lib/view.glsl"

layout(std430, binding = 5) readonly buffer TextureInputBlock { TextureInput texture_inputs[]; };
layout(std430, binding = 6) readonly buffer TileBlock { Tile tiles[]; };

const uint WRAP_BLACK = 0u;
const uint WRAP_CLAMP = 1u;
const uint WRAP_REPEAT = 2u;
const uint WRAP_MIRROR = 3u;
const uint WRAP_UDIM = 4u;
const uint NO_GROUP = 0xffffffffu;
const uint ALL_CHANNELS = 4u;
const float NARROWEST = 0.125;     // of a pixel: finer mip levels cost more than they show

#include "generated/textures.glsl"

Coordinates of_texture(TextureInput t, UvSets uv, UvSets uv_dx, UvSets uv_dy) {
    mat2 linear = mat2(t.texture_from_uv);
    return Coordinates(linear * set_of(uv, t.uv_set) + t.texture_offset,
                       linear * set_of(uv_dx, t.uv_set),
                       linear * set_of(uv_dy, t.uv_set));
}

// The arrays repeat; the other modes keep half a texel, of the mip level that is read, from the edge.
float wrapped(float s, uint mode, float half_texel) {
    if (mode == WRAP_REPEAT) return s;
    if (mode == WRAP_MIRROR) s = 1.0 - abs(mod(s, 2.0) - 1.0);
    return clamp(s, half_texel, 1.0 - half_texel);
}

bool is_outside(float s, uint mode) {
    return mode == WRAP_BLACK && (s < 0.0 || s > 1.0);
}

vec4 read_tile(Tile tile, TextureInput t, Coordinates c) {
    if (is_outside(c.at.x, t.wrap_s) || is_outside(c.at.y, t.wrap_t)) return vec4(0.0);
    float footprint = max(length(c.dx * tile.size), length(c.dy * tile.size)); // texels
    vec2 half_texel = min(0.5 * exp2(ceil(log2(max(footprint, 1.0)))) / tile.size, vec2(0.5));
    vec2 st = vec2(wrapped(c.at.x, t.wrap_s, half_texel.x), wrapped(c.at.y, t.wrap_t, half_texel.y));
    return read_group(tile.group, vec3(st, float(tile.layer)), c.dx, c.dy);
}

// UDIM 1001 + column + 10 row; NO_GROUP where the set has no such tile.
Tile find_tile(TextureInput t, inout Coordinates c) {
    if (t.wrap_s != WRAP_UDIM) return tiles[t.first_tile];
    vec2 cell = floor(c.at);
    c.at -= cell;
    float index = cell.x + 10.0 * cell.y;
    if (cell.x < 0.0 || cell.x > 9.0 || cell.y < 0.0 || index >= float(t.tile_count)) return Tile(vec2(1.0), NO_GROUP, 0u);
    return tiles[t.first_tile + uint(index)];
}

// UsdUVTexture's output at some coordinates, over the cell of its pixel that the sample stands for: as in pbrt-v4, whose ray
// differentials shrink with the number of samples, or the limit would be an image filtered twice.
vec4 read_texture(TextureInput t, Coordinates c) {
    c.dx *= max(view.cell.z, NARROWEST);
    c.dy *= max(view.cell.w, NARROWEST);
    Tile tile = find_tile(t, c);
    vec4 texel = read_tile(tile, t, c);
    return (t.channel == ALL_CHANNELS ? texel : vec4(texel[t.channel])) * t.scale + t.bias;
}

// The frame that normal maps are baked in: MikkTSpace's.
vec3 from_tangent_space(vec3 tangent_normal, vec3 n, vec3 dPdx, vec3 dPdy, Coordinates c) {
    mat2x3 along = along_coordinates(dPdx, dPdy, c);
    vec3 t = tangent_across(n, along[0]);
    if (t == vec3(0.0) || dot(tangent_normal, tangent_normal) == 0.0) return n;
    vec3 b = cross(n, t) * (dot(cross(n, t), along[1]) < 0.0 ? -1.0 : 1.0);
    return normalize(mat3(t, b, n) * tangent_normal);
}

// A material's textures in place of its constants; `normal` is turned by its normal map.
void apply_textures(inout Material material, inout vec3 normal, vec3 position, UvSets uv) {
    UvSets uv_dx = along_x(uv), uv_dy = along_y(uv);
    vec3 dPdx = dFdx(position), dPdy = dFdy(position);
    for (uint i = 0u; i < material.input_count; ++i) {
        TextureInput t = texture_inputs[material.first_input + i];
        Coordinates c = of_texture(t, uv, uv_dx, uv_dy);
        vec4 value = read_texture(t, c);
        if (t.field == FIELD_NORMAL) normal = from_tangent_space(value.xyz, normal, dPdx, dPdy, c);
        else set_field(material, t.field, value);
    }
}

// The same for what casts a shadow.
void apply_opacity_texture(inout Material material, UvSets uv) {
    UvSets uv_dx = along_x(uv), uv_dy = along_y(uv);
    for (uint i = 0u; i < material.input_count; ++i) {
        TextureInput t = texture_inputs[material.first_input + i];
        if (t.field == FIELD_OPACITY) set_field(material, t.field, read_texture(t, of_texture(t, uv, uv_dx, uv_dy)));
    }
}
