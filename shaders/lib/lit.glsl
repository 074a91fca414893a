// What one light adds to a pixel.
struct Lit {
    vec3 radiance;
    vec3 diffuse;              // the part of the diffuse lobe; only under SPLIT
    float sent;                // brightness that would fall on the surface without shadows
    float visible;             // the share of it that does
    float volumes;             // 1 for a light's volume, 0 for what is drawn without one
};
