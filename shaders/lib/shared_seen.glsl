// Of this draw's directions, four bits each: the share of their light that reaches the pixel.
uvec2 shared_seen;

float shared_visibility(uint number) {
    uint bits = number < 8u ? shared_seen.x : shared_seen.y;
    return float(bits >> (4u * (number & 7u)) & 15u) * (1.0 / 15.0);
}
