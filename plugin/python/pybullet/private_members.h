// Members that Bullet's worlds keep private, as pointers to members. The arguments of an explicit
// instantiation are exempt from access rules (C++17, [temp.spec] 6).
#pragma once

#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftMultiBodyDynamicsWorld.h>

namespace lazyccd::pybullet {

/// Defines member_of(Tag), which returns `member`.
template <class Tag, typename Tag::Pointer member>
struct PrivateMember {
  friend constexpr typename Tag::Pointer member_of(Tag) { return member; }
};

/// The deformable world's solver, and the number of its passes of continuous detection.
struct DeformableWorldSolver {
  using Pointer = btDeformableBodySolver* btDeformableMultiBodyDynamicsWorld::*;
  friend constexpr Pointer member_of(DeformableWorldSolver);
};
struct DeformableWorldPasses {
  using Pointer = int btDeformableMultiBodyDynamicsWorld::*;
  friend constexpr Pointer member_of(DeformableWorldPasses);
};
/// The solver that the deformable world's constraint solver calls.
struct ConstraintsSolver {
  using Pointer = btDeformableBodySolver* btDeformableMultiBodyConstraintSolver::*;
  friend constexpr Pointer member_of(ConstraintsSolver);
};
/// The soft world's solver, and whether the world deletes it.
struct SoftWorldSolver {
  using Pointer = btSoftBodySolver* btSoftMultiBodyDynamicsWorld::*;
  friend constexpr Pointer member_of(SoftWorldSolver);
};
struct SoftWorldOwnsSolver {
  using Pointer = bool btSoftMultiBodyDynamicsWorld::*;
  friend constexpr Pointer member_of(SoftWorldOwnsSolver);
};

template struct PrivateMember<DeformableWorldSolver,
                              &btDeformableMultiBodyDynamicsWorld::m_deformableBodySolver>;
template struct PrivateMember<DeformableWorldPasses,
                              &btDeformableMultiBodyDynamicsWorld::m_ccdIterations>;
template struct PrivateMember<ConstraintsSolver,
                              &btDeformableMultiBodyConstraintSolver::m_deformableSolver>;
template struct PrivateMember<SoftWorldSolver, &btSoftMultiBodyDynamicsWorld::m_softBodySolver>;
template struct PrivateMember<SoftWorldOwnsSolver, &btSoftMultiBodyDynamicsWorld::m_ownsSolver>;

}  // namespace lazyccd::pybullet
