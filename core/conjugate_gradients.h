// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <type_traits>

namespace polarscan {

// a / b; of several right-hand sides each for itself, and 0 where there is nothing left of one.
inline double StepLength(double a, double b) { return a / b; }
inline Eigen::Array3d StepLength(const Eigen::Array3d& a, const Eigen::Array3d& b) {
  return (b > 0).select(a / b, 0);
}

// Preconditioned conjugate gradients (Saad, Iterative Methods for Sparse Linear Systems, 9.2) for A x = b
// with a symmetric, positive definite A and the preconditioner M. The system keeps the vectors and makes the
// sums, in whatever form and precision suits it:
//   T Curvature()                   product = A direction; returns direction . product
//   T UpdateSolution(T length)      x += length direction, residual -= length product;
//                                   returns residual . M residual
//   void UpdateDirection(T share)   direction = M residual + share direction
// T: double, or Eigen::Array3d for three right-hand sides. It begins with direction = M residual and
// size = residual . M residual, and goes on while goes_on(size), `most` iterations at most. Returns the size
// that is left.
template <class T, class System, class GoesOn>
T ConjugateGradients(System& system, T size, int most, GoesOn&& goes_on) {
  for (int i = 0; i < most && goes_on(size); ++i) {
    const T curvature = system.Curvature();
    if constexpr (std::is_floating_point_v<T>)
      if (!(curvature > 0)) break;
    const T next = system.UpdateSolution(StepLength(size, curvature));
    system.UpdateDirection(StepLength(next, size));
    size = next;
  }
  return size;
}

}  // namespace polarscan
