// How many parameters a ray has: those of area lights.

const PARAMETERS: u32 = 4u;
