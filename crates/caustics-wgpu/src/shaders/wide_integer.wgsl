// Products of 32-bit integers that need 64 bits. Twin: u64 of Rust.

// The upper 32 bits of the product.
fn multiply_high(a: u32, b: u32) -> u32 {
    let a_low = a & 0xffffu;
    let a_high = a >> 16u;
    let b_low = b & 0xffffu;
    let b_high = b >> 16u;
    let low = a_low * b_low;
    let middle = a_high * b_low + (low >> 16u);
    let other = a_low * b_high + (middle & 0xffffu);
    return a_high * b_high + (middle >> 16u) + (other >> 16u);
}

// The product modulo `modulus`, which is below 2^31, as are both factors.
fn multiply_modulo(a: u32, b: u32, modulus: u32) -> u32 {
    var result = 0u;
    var term = a % modulus;
    var left = b;
    while left != 0u {
        if (left & 1u) != 0u {
            result = result + term;
            result -= select(0u, modulus, result >= modulus);
        }
        term = term + term;
        term -= select(0u, modulus, term >= modulus);
        left >>= 1u;
    }
    return result;
}
