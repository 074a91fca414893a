// ITU-R BT.709-6.
float luminance(vec3 linear_rec709) {
    return dot(linear_rec709, vec3(0.2126, 0.7152, 0.0722));
}
