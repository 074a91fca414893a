// Texture coordinates and how they change from pixel to pixel: taken before any branch, where derivatives are defined.
struct Coordinates {
    vec2 at, dx, dy;
};

// dP/du and dP/dv from the derivatives of position and coordinates, not to scale: solving for them makes them
// indifferent to mirrored coordinates and to the direction of the screen's axes.
mat2x3 along_coordinates(vec3 dPdx, vec3 dPdy, Coordinates c) {
    float determinant = c.dx.x * c.dy.y - c.dy.x * c.dx.y;
    return mat2x3(dPdx * c.dy.y - dPdy * c.dx.y, dPdy * c.dx.x - dPdx * c.dy.x) * sign(determinant);
}

// The direction in which u grows, across the normal n; 0 where there is none.
vec3 tangent_across(vec3 n, vec3 dPdu) {
    vec3 t = dPdu - n * dot(n, dPdu);
    return dot(t, t) == 0.0 ? vec3(0.0) : normalize(t);
}
