// What light adds to a pixel.
struct Lit {
    vec3 radiance;
    vec3 diffuse;              // the part of the diffuse lobe; only under SPLIT
    float sent;                // brightness that would fall on the surface without shadows
    float arrived;             // what of it does
    float volumes;             // of lights: 0 for what is drawn without one
};
