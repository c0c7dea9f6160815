// A square grid of any number of cells of equal area. Twin: grid.rs in caustics-sampling.

struct GridCell {
    corner: vec2<f32>,
    size: vec2<f32>,
    row: u32,
    column: u32,
}

fn grid_cell(count: u32, rows: u32, index: u32) -> GridCell {
    let short_columns = count / rows;
    let longer_rows = count % rows;
    let in_longer_rows = longer_rows * (short_columns + 1u);
    let is_longer = index < in_longer_rows;
    let columns = short_columns + select(0u, 1u, is_longer);
    let after = select(index - in_longer_rows, index, is_longer);
    let row = after / columns + select(longer_rows, 0u, is_longer);
    let column = after % columns;
    return GridCell(
        vec2(f32(column) / f32(columns), f32(index - column) / f32(count)),
        vec2(1.0 / f32(columns), f32(columns) / f32(count)),
        row,
        column,
    );
}

// Number of cells in a row.
fn grid_columns(count: u32, rows: u32, row: u32) -> u32 {
    return count / rows + select(0u, 1u, row < count % rows);
}
