#include "lib/uv_type.glsl"

#ifdef MANY_UVS
UvSets along_x(UvSets uv) { return mat4(dFdx(uv[0]), dFdx(uv[1]), dFdx(uv[2]), dFdx(uv[3])); }
UvSets along_y(UvSets uv) { return mat4(dFdy(uv[0]), dFdy(uv[1]), dFdy(uv[2]), dFdy(uv[3])); }
vec4 pair_of(UvSets uv, uint set) { return uv[set >> 1u]; }
#else
UvSets along_x(UvSets uv) { return dFdx(uv); }
UvSets along_y(UvSets uv) { return dFdy(uv); }
vec4 pair_of(UvSets uv, uint set) { return uv; }
#endif

vec2 set_of(UvSets uv, uint set) {
    vec4 pair = pair_of(uv, set);
    return (set & 1u) != 0u ? pair.zw : pair.xy;
}
