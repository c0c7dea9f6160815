// The little of nanoflann that a comparison needs, for a caller that knows no templates.

#include <cstddef>
#include <cstdint>
#include <exception>
#include <utility>
#include <vector>

#include <nanoflann.hpp>

namespace {

// Points in the caller's memory, three coordinates each.
struct Points {
    const float *coordinates;
    std::size_t count;

    std::size_t kdtree_get_point_count() const { return count; }
    float kdtree_get_pt(std::uint32_t point, std::size_t axis) const {
        return coordinates[3 * point + axis];
    }
    template <class Box> bool kdtree_get_bbox(Box &) const { return false; }
};

using Index = nanoflann::KDTreeSingleIndexAdaptor<
    nanoflann::L2_Simple_Adaptor<float, Points, float, std::uint32_t>, Points, 3, std::uint32_t>;

struct Tree {
    Points points;
    Index index;

    Tree(const float *coordinates, std::size_t count)
        : points{coordinates, count}, index(3, points, nanoflann::KDTreeSingleIndexAdaptorParams()) {
        // This release leaves it to the caller.
        index.buildIndex();
    }
};

using Found = std::vector<std::pair<std::uint32_t, float>>;

} // namespace

extern "C" {

// Null where memory runs out. The coordinates must outlive the tree.
void *caustics_nanoflann_new(const float *coordinates, std::size_t count) {
    try {
        return new Tree(coordinates, count);
    } catch (const std::exception &) {
        return nullptr;
    }
}

void caustics_nanoflann_delete(void *tree) { delete static_cast<Tree *>(tree); }

// Writes at most `wanted` indices and squared distances; returns how many.
std::size_t caustics_nanoflann_nearest(const void *tree, const float *point, std::size_t wanted,
                                       std::uint32_t *indices, float *distances) {
    return static_cast<const Tree *>(tree)->index.knnSearch(point, wanted, indices, distances);
}

void *caustics_nanoflann_new_found() { return new Found; }

void caustics_nanoflann_delete_found(void *found) { delete static_cast<Found *>(found); }

// Fills a list with pairs of index and squared distance in any order, says where they are, and
// returns how many.
std::size_t caustics_nanoflann_within(const void *tree, const float *point, float radius_squared,
                                      void *found, const void **pairs) {
    auto &list = *static_cast<Found *>(found);
    static_cast<const Tree *>(tree)->index.radiusSearch(point, radius_squared, list,
                                                        nanoflann::SearchParams(32, 0.0f, false));
    *pairs = list.data();
    return list.size();
}
}
