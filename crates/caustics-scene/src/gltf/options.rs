/// How files are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Whether receivers are [`Glossy`](crate::Surface::Glossy), with the base colour, metallicity
    /// and roughness that the file states, in place of Lambertian with the base colour alone.
    ///
    /// Off by default: Lambertian receivers are the quicker ones, look the same from everywhere, and
    /// are what reference pictures of caustics are made with. A material that glTF calls fully rough
    /// and not metallic has a faint sheen, too, when this is on.
    pub glossy_receivers: bool,
}
