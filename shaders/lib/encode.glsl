// Encodings of the packed GBuffer.

// IEC 61966-2-1.
vec3 srgb_from_linear(vec3 c) {
    c = clamp(c, 0.0, 1.0);
    return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}

vec3 linear_from_srgb(vec3 c) {
    return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c));
}

vec2 sign_not_zero(vec2 v) {
    return vec2(v.x >= 0.0 ? 1.0 : -1.0, v.y >= 0.0 ? 1.0 : -1.0);
}

// Cigolle et al. 2014, "A Survey of Efficient Representations for Independent Unit Vectors".
vec2 octahedral_from_unit(vec3 n) {
    vec2 p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    return n.z >= 0.0 ? p : (1.0 - abs(p.yx)) * sign_not_zero(p);
}

vec3 unit_from_octahedral(vec2 p) {
    vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * sign_not_zero(n.xy);
    return normalize(n);
}

// Octahedral 12 + 12 bits in three bytes: the high bytes, then both low nibbles. Code 2048 is 0, so the axes are exact.
vec3 bytes_from_unit(vec3 n) {
    uvec2 code = uvec2(clamp(round(octahedral_from_unit(n) * 2047.0), -2047.0, 2047.0) + 2048.0);
    return vec3(code >> 4u, (code.x & 15u) << 4u | (code.y & 15u)) / 255.0;
}

vec3 unit_from_bytes(vec3 bytes) {
    uvec3 b = uvec3(round(bytes * 255.0));
    uvec2 code = (b.xy << 4u) | uvec2(b.z >> 4u, b.z & 15u);
    return unit_from_octahedral((vec2(code) - 2048.0) / 2047.0);
}
