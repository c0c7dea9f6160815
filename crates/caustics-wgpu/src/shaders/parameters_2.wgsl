// How many parameters a ray has: those of lights without area.

const PARAMETERS: u32 = 2u;
