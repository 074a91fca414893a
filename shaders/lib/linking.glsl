layout(std430, binding = 7) readonly buffer LinkBlock { uint link_bits[]; };

const uint ALL_LINKED = 0xffffffffu;

// Does the row of bits from `first_word` on hold a link set?
bool is_linked(uint first_word, uint link_set) {
    if (first_word == ALL_LINKED) return true;
    return (link_bits[first_word + (link_set >> 5u)] >> (link_set & 31u) & 1u) != 0u;
}
