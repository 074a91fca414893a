// Jarzynski & Olano 2020, "Hash Functions for GPU Rendering", JCGT 9(3): pcg4d.
uvec4 pcg4d(uvec4 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

uint laine_karras(uint x, uint key) {
    x += key;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    return x ^ x * 0x8d22f6e6u;
}

uint owen_scrambled(uint bits, uint key) {
    return bitfieldReverse(laine_karras(bitfieldReverse(bits), key));
}

// Number `index` of the seed's own sequence in [0, 1), 24 bits, stratified at every power of two: Burley 2020,
// "Practical Hash-based Owen Scrambling", JCGT 9(4). Sequences of different seeds know nothing of each other.
float owen_van_der_corput(uint index, uvec4 seed) {
    uvec4 keys = pcg4d(seed);
    uint shuffled = owen_scrambled(index, keys.x);
    return float(owen_scrambled(bitfieldReverse(shuffled), keys.y) >> 8u) * (1.0 / 16777216.0);
}

// Point `index` of the seed's own Owen-scrambled (0, 2)-sequence, as passes/sampling.py has it.
vec2 owen_sobol(uint index, uvec4 seed) {
    uvec4 keys = pcg4d(seed);
    uint shuffled = owen_scrambled(index, keys.x), second = 0u;
    for (uint bits = shuffled, column = 1u << 31u; bits != 0u; bits >>= 1u, column ^= column >> 1u)
        if ((bits & 1u) != 0u) second ^= column;
    uvec2 point = uvec2(owen_scrambled(bitfieldReverse(shuffled), keys.y), owen_scrambled(second, keys.z));
    return vec2(point >> 8u) * (1.0 / 16777216.0);
}
