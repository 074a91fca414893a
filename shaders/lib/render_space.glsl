// Scenes are in linear Rec.709; light and reflectance meet in the render space.
vec3 render_from_rec709(vec3 color) {
#ifdef RENDER_FROM_REC709
    return RENDER_FROM_REC709 * color;
#else
    return color;
#endif
}
