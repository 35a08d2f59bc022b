#include "matrix/supernodal_cholesky.h"

#include <Eigen/Cholesky>
#include <Eigen/OrderingMethods>
#include <algorithm>
#include <utility>

namespace bslam::matrix {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

// Rows below the diagonal of each column, ascending: of A permuted by `place`.
std::vector<std::vector<int>> lower_rows(std::span<const BlockPattern::Position> positions,
                                         const std::vector<int>& place) {
  std::vector<std::vector<int>> out(place.size());
  for (const auto& [row, column] : positions) {
    const auto [low, high] = std::minmax(place[at(row)], place[at(column)]);
    if (low < high) out[at(low)].push_back(high);
  }
  return out;
}

// Returns the rows of each column of L. Eliminating a column connects all of its rows, so that they also become rows of
// the first of them, its parent in the elimination tree.
std::vector<std::vector<int>> factor_rows(std::vector<std::vector<int>> rows) {
  for (std::size_t j = 0; j < rows.size(); ++j) {
    std::ranges::sort(rows[j]);
    const auto end = std::unique(rows[j].begin(), rows[j].end());
    rows[j].erase(end, rows[j].end());
    if (rows[j].empty()) continue;
    std::vector<int>& parent = rows[at(rows[j].front())];
    parent.insert(parent.end(), rows[j].begin() + 1, rows[j].end());
  }
  return rows;
}

// Returns a postorder of the elimination tree: all descendants of a column directly precede it. It does not change the
// number of entries of L.
std::vector<int> postorder(const std::vector<std::vector<int>>& rows) {
  const int n = static_cast<int>(rows.size());
  std::vector<std::vector<int>> children(rows.size());
  std::vector<int> stack, order;
  for (int j = n - 1; j >= 0; --j) {
    if (rows[at(j)].empty()) stack.push_back(j);
  }
  for (int j = 0; j < n; ++j) {
    if (!rows[at(j)].empty()) children[at(rows[at(j)].front())].push_back(j);
  }
  while (!stack.empty()) {  // parents before children, the last child first; reversed at the end
    const int j = stack.back();
    stack.pop_back();
    order.push_back(j);
    stack.insert(stack.end(), children[at(j)].begin(), children[at(j)].end());
  }
  std::ranges::reverse(order);
  return order;
}

std::vector<int> inverse_of(const std::vector<int>& order) {
  std::vector<int> place(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) place[at(order[k])] = static_cast<int>(k);
  return place;
}

// Block row of A per block row of P A P^T.
std::vector<int> minimum_degree_order(std::span<const BlockPattern::Position> positions, int n) {
  std::vector<Eigen::Triplet<double, int>> entries;
  for (const auto& [row, column] : positions) {
    entries.emplace_back(row, column, 1.0);
    if (row != column) entries.emplace_back(column, row, 1.0);
  }
  Eigen::SparseMatrix<double> graph(n, n);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(graph, order);
  return {order.indices().data(), order.indices().data() + n};
}

// Columns of L that are stored together, in block rows.
struct Columns {
  int first = 0, count = 0;
  std::vector<int> below;  // rows below those of the columns
};

int total(const std::vector<int>& begin, const std::vector<int>& rows) {
  int sum = 0;
  for (const int r : rows) sum += begin[at(r) + 1] - begin[at(r)];
  return sum;
}

// Returns true if column `next`, which follows `last`, is added to its supernode: this adds only few zeros, or the
// panel is narrow.
bool belong_together(const Columns& last, const Columns& next, const std::vector<int>& begin) {
  constexpr int kNarrow = 36;         // columns
  constexpr double kFewZeros = 0.15;  // maximum fraction of zeros among the entries of columns that are extended
  if (last.below.empty() || last.below.front() != next.first) return false;
  const int columns = begin[at(last.first + last.count)] - begin[at(last.first)],
            more = begin[at(next.first + next.count)] - begin[at(next.first)];
  const int rows = more + total(begin, next.below), zeros = rows - total(begin, last.below);
  return columns + more <= kNarrow || zeros <= kFewZeros * (columns + rows);
}

}  // namespace

SupernodalCholesky::SupernodalCholesky(const BlockPattern& pattern, std::span<const int> sizes)
    : positions_(pattern.positions()), size_(sizes.begin(), sizes.end()), offset_(1, 0), begin_(1, 0) {
  for (const int size : size_) offset_.push_back(offset_.back() + size);
  const std::vector<int> by_degree = minimum_degree_order(positions_, static_cast<int>(size_.size()));
  const std::vector<int> after = postorder(factor_rows(lower_rows(positions_, inverse_of(by_degree))));
  std::vector<int> order;
  for (const int k : after) order.push_back(by_degree[at(k)]);
  place_ = inverse_of(order);
  for (const int block_row : order) begin_.push_back(begin_.back() + size_[at(block_row)]);
  make_supernodes(factor_rows(lower_rows(positions_, place_)));
  row_in_panel_.assign(at(begin_.back()), 0);
}

void SupernodalCholesky::make_supernodes(const std::vector<std::vector<int>>& structure) {
  std::vector<Columns> found;
  for (int j = 0; j < static_cast<int>(structure.size()); ++j) {
    found.push_back({j, 1, structure[at(j)]});
    while (found.size() > 1 && belong_together(found[found.size() - 2], found.back(), begin_)) {
      Columns next = std::move(found.back());
      found.pop_back();
      found.back().count += next.count;
      found.back().below = std::move(next.below);
    }
  }
  std::vector<int> supernode_of_block(structure.size());
  std::size_t values = 0;
  for (const Columns& c : found) {
    Supernode s{begin_[at(c.first)], begin_[at(c.first + c.count)] - begin_[at(c.first)], {}, values, {}};
    for (int r = s.first; r < s.first + s.columns; ++r) s.rows.push_back(r);
    for (const int b : c.below) {
      for (int r = begin_[at(b)]; r < begin_[at(b) + 1]; ++r) s.rows.push_back(r);
    }
    values += s.rows.size() * at(s.columns);
    for (int k = 0; k < c.count; ++k) supernode_of_block[at(c.first + k)] = static_cast<int>(supernodes_.size());
    supernode_of_.insert(supernode_of_.end(), at(s.columns), static_cast<int>(supernodes_.size()));
    supernodes_.push_back(std::move(s));
  }
  values_.resize(values);
  for (std::size_t b = 0; b < positions_.size(); ++b) {
    const int column = std::min(place_[at(positions_[b].row)], place_[at(positions_[b].column)]);
    supernodes_[at(supernode_of_block[at(column)])].blocks.push_back(static_cast<int>(b));
  }
}

// Writes the entries of A to the panel. `row_in_panel_` must be that of the supernode.
void SupernodalCholesky::assemble(const BlockMatrix& A, const Supernode& s) {
  Panel L = panel(s);
  L.setZero();
  for (const int b : s.blocks) {
    const auto [row, column] = positions_[at(b)];
    const int p = place_[at(row)], q = place_[at(column)];
    const auto block = A.block(b);
    if (p >= q) {
      L.block(row_in_panel_[at(begin_[at(p)])], begin_[at(q)] - s.first, block.rows(), block.cols()) = block;
    } else {
      L.block(row_in_panel_[at(begin_[at(q)])], begin_[at(p)] - s.first, block.cols(), block.rows()) =
          block.transpose();
    }
  }
}

// Subtracts the contribution of an eliminated descendant from the panel. Rows `from` to `to` of the descendant are
// columns of the supernode.
void SupernodalCholesky::subtract(const Supernode& descendant, std::size_t from, std::size_t to, const Supernode& s) {
  const auto rows = static_cast<Eigen::Index>(descendant.rows.size() - from),
             columns = static_cast<Eigen::Index>(to - from);
  const Panel L = panel(descendant);
  const auto below = L.bottomRows(rows);
  update_.resize(rows, columns);
  update_.noalias() = below * below.topRows(columns).transpose();
  Panel out = panel(s);
  for (Eigen::Index j = 0; j < columns; ++j) {
    double* column = out.col(descendant.rows[from + static_cast<std::size_t>(j)] - s.first).data();
    for (Eigen::Index i = j; i < rows; ++i)
      column[row_in_panel_[at(descendant.rows[from + static_cast<std::size_t>(i)])]] -= update_(i, j);
  }
}

// Factorises the panel's square part and divides the rest by it.
bool SupernodalCholesky::eliminate(const Supernode& s) {
  Panel L = panel(s);
  auto square = L.topRows(s.columns);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(square);
  if (factor.info() != Eigen::Success) return false;
  const Eigen::Index below = L.rows() - s.columns;
  if (below == 0) return true;
  auto rest = L.bottomRows(below);
  square.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(rest);
  return true;
}

bool SupernodalCholesky::factorise(const BlockMatrix& A) {
  // The supernodes whose elimination affects each supernode next, and their first rows that are its columns.
  std::vector<std::vector<int>> waiting(supernodes_.size());
  std::vector<std::size_t> next(supernodes_.size());
  const auto pass_on = [&](int index) {
    const Supernode& s = supernodes_[at(index)];
    if (next[at(index)] < s.rows.size()) waiting[at(supernode_of_[at(s.rows[next[at(index)]])])].push_back(index);
  };
  for (int index = 0; index < static_cast<int>(supernodes_.size()); ++index) {
    const Supernode& s = supernodes_[at(index)];
    for (std::size_t k = 0; k < s.rows.size(); ++k) row_in_panel_[at(s.rows[k])] = static_cast<int>(k);
    assemble(A, s);
    for (const int d : waiting[at(index)]) {
      const Supernode& descendant = supernodes_[at(d)];
      const std::size_t from = next[at(d)];
      const auto end = std::lower_bound(descendant.rows.begin() + static_cast<std::ptrdiff_t>(from),
                                        descendant.rows.end(), s.first + s.columns);
      next[at(d)] = static_cast<std::size_t>(end - descendant.rows.begin());
      subtract(descendant, from, next[at(d)], s);
      pass_on(d);
    }
    waiting[at(index)] = {};
    if (!eliminate(s)) return false;
    next[at(index)] = at(s.columns);
    pass_on(index);
  }
  return true;
}

Eigen::MatrixXd SupernodalCholesky::permuted(const Eigen::MatrixXd& B, bool back) const {
  Eigen::MatrixXd out(B.rows(), B.cols());
  for (std::size_t b = 0; b < size_.size(); ++b) {
    const int of_A = offset_[b], of_L = begin_[at(place_[b])];
    out.middleRows(back ? of_A : of_L, size_[b]) = B.middleRows(back ? of_L : of_A, size_[b]);
  }
  return out;
}

Eigen::MatrixXd SupernodalCholesky::solve(Eigen::MatrixXd B) const {
  Eigen::MatrixXd X = permuted(B, false);
  for (const Supernode& s : supernodes_) {
    const ConstPanel L = panel(s);
    auto own = X.middleRows(s.first, s.columns);
    L.topRows(s.columns).triangularView<Eigen::Lower>().solveInPlace(own);
    const Eigen::MatrixXd rest = L.bottomRows(L.rows() - s.columns) * own;
    for (Eigen::Index i = 0; i < rest.rows(); ++i)
      X.row(s.rows[at(s.columns) + static_cast<std::size_t>(i)]) -= rest.row(i);
  }
  for (auto s = supernodes_.rbegin(); s != supernodes_.rend(); ++s) {
    const ConstPanel L = panel(*s);
    Eigen::MatrixXd rest(L.rows() - s->columns, X.cols());
    for (Eigen::Index i = 0; i < rest.rows(); ++i)
      rest.row(i) = X.row(s->rows[at(s->columns) + static_cast<std::size_t>(i)]);
    auto own = X.middleRows(s->first, s->columns);
    own.noalias() -= L.bottomRows(rest.rows()).transpose() * rest;
    L.topRows(s->columns).triangularView<Eigen::Lower>().transpose().solveInPlace(own);
  }
  return permuted(X, true);
}

Eigen::SparseMatrix<double> SupernodalCholesky::factor() const {
  Eigen::SparseMatrix<double> out(begin_.back(), begin_.back());
  out.reserve(static_cast<Eigen::Index>(values_.size()));
  for (const Supernode& s : supernodes_) {
    const ConstPanel L = panel(s);
    for (int c = 0; c < s.columns; ++c) {
      out.startVec(s.first + c);
      for (Eigen::Index r = c; r < L.rows(); ++r)
        out.insertBack(s.rows[static_cast<std::size_t>(r)], s.first + c) = L(r, c);
    }
  }
  out.finalize();
  return out;
}

}  // namespace bslam::matrix
