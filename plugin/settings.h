// Numbers that change the motion, or which contacts are solved: value, unit, and what breaks
// without it or with another value. CONTRIBUTING.md, "How to change a number", says what to run
// again.
//
// Not here:
//  - What an application chooses. Those defaults stand in SolverOptions (lazyccd/bullet/options.h):
//    thickness, position_correction, restitution, restitution_threshold, rest_speed, rest_damping,
//    untangling_speed, max_impulse_rounds, solver_iterations, max_zone_rounds, jump_speed.
//  - What changes only the cost, and bounds of rounding. They stand beside their code.
#pragma once

#include <cstddef>
#include <cstdint>

namespace lazyccd::bullet::settings {

/// How a displacement between two steps is explained: as motion, which is swept, or as a jump.
namespace displacement {

/// m/s. A body with a node faster than light has exploded. Rounding leaves nothing of its surface,
/// and its swept volume would keep exact arithmetic busy for minutes.
inline constexpr double max_node_speed = 299792458;
/// Metres. A body has exploded too if a node moves so far in a step: half of what Bullet allows
/// forces to do (btSoftBodyWorldInfo::m_maxDisplacement, by default).
inline constexpr double max_node_displacement = 500;
/// Of the thickness. A body has exploded too if a node moves so far in a step that the spacing of
/// scalars of that size is larger than this part.
inline constexpr double resolved_part = 0.1;
/// Metres. Points of a rigid body farther from its centre do not count. Planes and terrains have no
/// end, so the smallest turn would move a point of them by any distance.
inline constexpr double max_radius = 100;
/// Time steps in which the velocity of a kinematic body may make its displacement. A motion state
/// moves the body once a frame, which may have so many substeps; with fewer, it would jump.
inline constexpr double max_substeps = 100;
/// Time steps. A longer displacement is spread over the substeps of a frame. More than one, because
/// rounding errors make one step a little longer.
inline constexpr double min_steps_to_spread = 1.5;
/// Of the displacement: the velocity explains it if no more than this is left.
inline constexpr double velocity_tolerance = 0.1;
/// Of the displacement one step before: that explains this one if no more is between them. What
/// drives a body accelerates it, so this is wider than the tolerance of the velocity.
inline constexpr double drive_tolerance = 0.5;
/// Of a body's radius. Bullet moves dynamic bodies out of each other by as much without velocity;
/// without it, that would be a jump, and the body would not be swept.
inline constexpr double split_impulse_fraction = 0.25;
/// Pinned nodes jump if they moved by more than this multiple of the last step's displacement, plus
/// `jump_speed`. An application may drive them faster than in the step before.
inline constexpr int max_pinned_growth = 2;
/// They do not jump up to so many time steps of their own velocity beyond that.
inline constexpr int pinned_steps_of_velocity = 2;
/// A body that LazyCCD held moves this many times as far as its motion, until it has caught up.
inline constexpr int catch_up_factor = 2;
/// Or it moves by this part of the way that is left, if that is farther. Otherwise a body whose
/// motion ends would never arrive.
inline constexpr double min_catch_up_fraction = 0.1;
/// 1/kg, and 1/(kg m^2) for the inertia. A body whose inverse mass and inverse inertia are not
/// larger counts as one of infinite mass, which impulses do not move.
inline constexpr double min_inverse_mass = 1e-12;

}  // namespace displacement

/// Which sleeping bodies take part in a step.
namespace sleeping {

/// Steps alone after which a sleeper that took part is left out again. With fewer, it would come
/// and go while something moves near it, and each change builds the scene anew.
inline constexpr int min_steps_alone = 8;
/// About so many pinned nodes of a sleeper show whether the application moved it. If it moves none
/// of these, the body stays out of the step.
inline constexpr std::size_t pinned_samples = 4;
/// Multiple of the distance of contacts within which a sleeper takes part. Bounds of sleepers are
/// never updated, so it is more than one.
inline constexpr int reach_factor = 2;

}  // namespace sleeping

/// The triangles of rigid shapes. Contacts act at them, so each number here moves what rests on a
/// round shape. Latitudes are angles from the equator, in radians.
namespace shapes {

/// Of the thickness: how deep triangles may lie inside of the shape. What rests on the shape sinks
/// in by as much; with less, there are more triangles to meet.
inline constexpr double depth_of_thickness = 0.5;
/// Spacing of the points of a ring, in spacings of rings. A little more than one, so that the
/// triangles between two rings are nearly equilateral.
inline constexpr double ball_point_spacing = 1.1;
/// Depth of the hull below a ball, by radius / rings^2, with that spacing.
inline constexpr double ball_depth_factor = 0.7;
/// Rings from the equator of a ball to a pole. With fewer, it rolls on its corners; with more, cost
/// grows with the square.
inline constexpr int min_ball_rings = 4, max_ball_rings = 12;
/// Latitude of a capsule's two equators, one for each end of its cylinder. Not zero, as there the
/// support point may lie at either end.
inline constexpr double capsule_equator = 1e-4;
/// Latitudes of the rings of a cylinder or cone: of its side and of its ends. The end is just below
/// pi / 2, where all support points would be one.
inline constexpr double cylinder_side = 0.46, cylinder_end = 1.57;
/// Rings towards each end of a cylinder whose rim the margin rounds.
inline constexpr int min_rim_rings = 3, max_rim_rings = 6;
/// Of the radius: a smaller depth does not add rings to a rim.
inline constexpr double min_rim_depth = 0.005;
/// Points in a quarter of a circle. With fewer, a cylinder rolls on its edges.
inline constexpr int min_quarter_points = 3, max_quarter_points = 12;
/// Side of a plane's square, in sides of the next smaller one around what is near. A smaller ratio
/// makes more triangles, a larger one narrower triangles, whose contacts are less exact.
inline constexpr int plane_square_ratio = 8;
/// Cosine of the largest angle between triangles of one side of a convex part, a milliradian. The
/// triangles of a flat side differ by rounding; contacts need one side there.
inline constexpr double min_same_side_cosine = 1 - 5e-7;
/// Of the distance to the first face that a ray leaves through: others within this lie in the same
/// plane, or nearly so.
inline constexpr double exit_tolerance = 1e-4;
/// Sides and vertices of a part that is met as a convex polyhedron. Each pair with it costs a step
/// for each side. The detector meets larger parts.
inline constexpr std::size_t max_convex_sides = 128, max_convex_vertices = 256;
/// Radians, 30 degrees. An edge whose faces meet at a larger angle is sharp: a real edge of the
/// shape, and not one of the tessellation of a curved surface.
inline constexpr double sharp_angle = 0.5235987755982988;
/// Vertices of a soft body that show whether it may be inside of a mesh. Only then is the whole
/// mesh read. A body that is inside with others alone passes through the surface, which shows
/// anyway.
inline constexpr std::int32_t inside_samples = 64;

}  // namespace shapes

/// The regions in which obstacles are read. These change only the cost.
namespace regions {

/// Of what is needed: a region that is larger along an axis is read anew, smaller.
inline constexpr int largest_excess = 4;
/// In sums of the diagonals of two groups of soft bodies: if the diagonal of both together is
/// longer, they lie far apart and have a region each.
inline constexpr int group_distance = 8;

}  // namespace regions

/// Which pairs are near, and which of them get a constraint.
namespace detection {

/// Pairs are near if their distance is at most this multiple of their thickness. Resting contacts
/// lie at one thickness; with a factor of 1 they would be near in one step and not in the next.
inline constexpr double distance_factor = 1.1;
/// In median edges of a body: its pairs farther apart are not found. The number of near pairs grows
/// with the square of this distance.
inline constexpr double max_median_edges = 2;
/// Of the thickness. A pair that starts nearer touches: it has no normal yet, and gets no
/// constraint.
inline constexpr double touching_gap = 1e-6;
/// Factor on the gap of pairs that were selected in the last step. Another pair with the same key
/// must have a gap below this fraction to replace one of them. With 1, pairs at equal distances
/// take turns, and their impulses start anew each time.
inline constexpr double hysteresis = 0.999;
/// Pairs constrain the same points if their weights and normals, rounded to so many steps per unit,
/// are equal. With coarser steps too few constraints are left; with finer ones they fight each
/// other.
inline constexpr double weight_resolution = 16, normal_resolution = 4;
/// Depth of a hidden contact behind the plane of the one that hides it, as a part of the distance
/// of their points. With 0, contacts with neighbours in a flat surface come and go with rounding.
/// With more, fewer contacts are hidden.
inline constexpr double hidden_slope = 0.05;
/// So many contacts of a primitive may hide others: its nearest ones that nothing hides. A large
/// face has many contacts beside each other, which hide nothing.
inline constexpr std::size_t max_hiding = 8;
/// Of the distance within which pairs are found: how far vertices may move along each axis and
/// count as in place. After their contacts were found, each of two bodies may move by twice that.
/// So they come nearer by at most 4 sqrt(3) times this, 9 % of the distance. That is less than what
/// distance_factor adds to the thickness.
inline constexpr double max_cached_move = 0.013;
/// Of that distance: a body with something nearer is searched anew, as it may change its side while
/// it stays in place.
inline constexpr double min_cached_distance = 0.1;
/// Of the thickness. A seam is closed where its nodes are at most this far apart. Contacts across a
/// closed seam would push its two sides apart.
inline constexpr double closed_seam = 0.5;
/// m/s. The smallest thickness is what rounding needs, plus this speed times the step. The response
/// leaves a residual that is a fraction of it.
inline constexpr double resolved_speed = 4e-4;
/// That thickness is set to `resolution_spare` times what is needed. It shrinks again where it is
/// more than `resolution_excess` times too large. Otherwise it, and what rests, would change in
/// each step.
inline constexpr int resolution_spare = 2, resolution_excess = 4;

}  // namespace detection

/// Contacts with simple rigid shapes, found without the detector.
namespace simple_shapes {

/// Pairs of a vertex and a part of one kind. With more, the largest obstacles are left to the
/// detector, whose hierarchy is faster.
inline constexpr std::int64_t max_pairs = 1 << 15;
/// Motions in succession in which an obstacle was not clear, after which the detector takes it. An
/// impact may last for half a second; with fewer, the detector would take what it hits.
inline constexpr int max_unclear_motions = 32;
/// Of the thickness: what the response may leave of it at rest. If a body at that distance may lie
/// within the part's corners, the detector takes the part.
inline constexpr double kept_thickness = 0.9;
/// A contact point with more weight than this at one vertex is left to the constraint of the
/// vertex. Both would push the same node.
inline constexpr double vertex_weight = 0.999;
/// In radii of the largest primitive at the start: vertices farther from a round part have no face
/// or edge that needs a constraint. The detector decides about what stretches more.
inline constexpr int reach_in_radii = 2;
/// Of the thickness: a vertex that stays higher than this above a side counts as held there. Edges
/// between two such vertices need no constraint of their own.
inline constexpr double held_height = 0.5;
/// Of the separation: an edge that is this much higher where the next side begins may come down
/// there, so it gets a second constraint.
inline constexpr double next_side_height = 0.25;
/// Steps of conservative advancement to the time at which a pair is near. What is not near by then
/// gets a constraint all the same.
inline constexpr int max_advances = 8;
/// How often the step is halved to find a plane that separates a pair all the time. What has none
/// by then counts as not clear.
inline constexpr int max_halvings = 3;
/// Turns of the search for the lowest point of an edge above all sides of a polyhedron. A search
/// that takes longer ends with the plane that it has.
inline constexpr int max_edge_turns = 32;
/// Shortest sum of two unit normals of which the direction still means something. Below it, the
/// two sides face in opposite directions.
inline constexpr double min_normal_sum = 1e-3;

}  // namespace simple_shapes

/// Edges inside of a smooth surface of an obstacle need no constraint: the faces on both sides hold
/// what comes near. With constraints there, what slides is caught at each edge.
namespace internal_edges {

/// Of the thickness: how far a soft body may sink in between its vertices.
inline constexpr double max_sag = 0.5;
/// Part of an obstacle's edges that must be internal for the detector to leave them out. With
/// fewer, testing all pairs again after the response takes longer than it saves.
inline constexpr double min_left_out = 0.75;
/// And of all edges of the scene, because all pairs of the scene are then tested again.
inline constexpr double min_left_out_of_scene = 0.25;
/// Edges of soft bodies may become longer than at the start of the topology by this factor. If they
/// stretch more, they sink in farther than max_sag.
inline constexpr double max_stretch = 1.25;
/// A barycentric coordinate below this value counts as zero: the closest point is at an edge or a
/// corner.
inline constexpr float border = 0x1p-10f;
/// Radians; more than rounding changes normals. A contact that leans farther out than the surface
/// bends belongs to another face.
inline constexpr double normal_tolerance = 0.02;

}  // namespace internal_edges

/// The constraint of one contact.
namespace row {

/// Of the shortest edge: the largest thickness within one body. With more, neighbours
/// in a flat cloth would push each other away.
inline constexpr double max_thickness_of_edge = 0.5;
/// Of the thickness: position correction widens a gap up to this. The rest is room in
/// which gaps of what rests may change without correction.
inline constexpr double corrected_thickness = 0.5;
/// Bound of the compliance: the largest inverse mass divided by this. A row that can only move a
/// node of small weight would throw that node far away. With the bound the node moves at most 16
/// times the gap, the root of this, and the next detection finds what is left.
inline constexpr double max_mass_ratio = 256;

}  // namespace row

/// The sweeps of projected Gauss-Seidel over the rows of an island.
namespace solver {

/// m/s. A change of displacement per step below this speed is invisible; sweeps end there.
inline constexpr double min_speed = 3e-5;
/// Sweeps also end when the change is below this fraction of the approach that the contacts stop.
/// Where they meet fast, min_speed alone would take many sweeps for what nobody sees.
inline constexpr double min_fraction = 3e-3;
/// m/s. Contacts that approach more slowly are at rest or soon will be. An error left there shows
/// as creep, so they get more sweeps. Without them a robot that presses a cloth on a table pushes a
/// node below its top (tests with PyBullet).
inline constexpr double slow_approach = 0.25;
/// m/s. Contacts also count as resting if, with last step's impulses, no row is violated by more
/// than this, whatever the load.
inline constexpr double resting_speed = 0.02;
/// Of the load: sweeps of resting contacts also end when the change is below this.
inline constexpr double min_fraction_at_rest = 1e-4;
/// Factor of the number of sweeps for slow and for resting contacts. With less, what rests creeps.
inline constexpr int slow_sweep_factor = 4;
/// Divisor of the number of sweeps for split impulses. Gaps that are still too narrow are restored
/// in the next steps.
inline constexpr int split_sweep_divisor = 5;
/// Divisor of the number of sweeps in rounds in turn with links. Each round goes on from the last.
inline constexpr int round_sweep_divisor = 10;
/// Of the first change of such a round: its sweeps also end when the change is below this.
inline constexpr double round_fraction = 0.03;
/// Of a gap that is to be kept, not widened: split impulses stop there, so that the tolerance of
/// the velocity solve does not trigger them.
inline constexpr double split_gap_fraction = 0.999;
/// Sweeps from one full sweep to the next. Most rows never act, so the sweeps in between visit only
/// batches that carry an impulse. The interval doubles if a full sweep activated no new batch.
inline constexpr int first_full_sweep_interval = 8;
/// Number of sweeps in which friction that is a fraction of the sliding is computed anew. After
/// them its size stays, as that of Tresca's friction. It does not go to zero with the load, so
/// contacts whose load comes and goes with their friction would never settle.
inline constexpr int sliding_sweeps = 8;
/// The extrapolation starts anew if a sweep's change exceeds this multiple of the smallest change
/// so far. Without it, the sweeps may diverge.
inline constexpr float max_change_growth = 4;
/// Sweeps also end where they stall, as between two heavy bodies that press on light nodes. The
/// next step goes on from their impulses. An interval is the limit of the sweeps divided by
/// `intervals_of_limit`, and at least `min_stall_interval` sweeps. They stall if both of the
/// conditions below hold.
inline constexpr int intervals_of_limit = 16, min_stall_interval = 25;
/// First: the least change of an interval stays above this part of that in the interval before. It
/// is 0.5, squared as SweepChange::largest is.
inline constexpr float stalled_change_squared = 0.25F;
/// Second: all changes of the interval together are below this part of all that the sweeps have
/// changed so far.
inline constexpr double stalled_fraction = 1e-4;
/// A row is light if a rigid body makes up more than this part of its compliance. Splitting the
/// mass of the body over blocks would make it converge slowly, so all such rows come into one
/// block.
inline constexpr double max_body_share = 0.02;
/// Rows of a block, at least, and blocks of an island in a stage, at most. Blocks split the masses
/// that they share: the more blocks, the more threads, but the slower the sweeps converge.
inline constexpr std::size_t min_block_rows = 256, max_blocks = 32;
/// The order of the rows, and so the last digits of the result: bits per axis of the Morton code
/// that sorts them in space. With fewer, rows of one cell keep the order of the contacts.
inline constexpr int morton_bits_per_axis = 10;
/// The same: batches of rows that are filled at the same time. The more, the fewer are closed
/// before they are full. The rows of a batch share no node, but split the mass of a rigid body.
inline constexpr int max_open_batches = 8;
/// The same: layers of rows that share no node. The last one takes what fits no other, so its rows
/// may share nodes. With max_open_batches they fill a mask of 64 bits.
inline constexpr int max_layers = 56;

}  // namespace solver

/// Rigid bodies that rest on other rigid ones, as Bullet's contacts say, and hold against soft
/// ones.
namespace supports {

/// Of what a motion moves the body: it moves the supports too if it moves them by more. What is
/// below may be rounding of their normals. With less, a body on a flat ground would be held against
/// sliding by the rounding of its four normals.
inline constexpr double min_held_part = 0.03;
/// Sweeps over the supports of a body. Most bodies have four.
inline constexpr int max_sweeps = 50;
/// Of the tolerance below: the sweeps end when no support changes by more.
inline constexpr double settled_fraction = 0.1;
/// A support holds if it moves by less than this fraction of what the impulse would move without
/// it. With less, supports come and go by what the sweeps leave.
inline constexpr double holding_fraction = 0.01;
/// m/s. A body keeps no more of a load than this speed. If Bullet's next solve does not take it up,
/// as with restitution, the body moves with it. At 1/60 s it passes on cloth of three times its
/// weight at rest. The support keeps the rest.
inline constexpr double max_load_speed = 0.5;

}  // namespace supports

/// Limits and motors of multibodies' joints.
namespace joints {

/// A joint is at its limit if it is nearer than this fraction of its range, and than this many
/// radians or metres. With less, rounding decides whether it is held.
inline constexpr double near_limit = 1e-3;
/// m/s. A motor exerts at most what gives the mass of the multibody this speed in a step. It may be
/// far stronger. What presses light nodes against something fixed with all of that could not be
/// solved.
inline constexpr double max_push_speed = 3;
/// Of a motor's range: it gives way only to a reaction that is outside of the range by more, so
/// that rounding does not change its state from step to step.
inline constexpr double slack = 0.01;
/// Of a motor's largest impulse: one that exerts more for Bullet's own constraints has nothing
/// left.
inline constexpr double almost_all = 1 - 1e-6;
/// How often contacts are solved again after other joints are held: with limits alone, and if there
/// are motors. With fewer, joints are left in states that do not fit to the contacts.
inline constexpr int max_limit_rounds = 3, max_motor_rounds = 6;
/// In so many last rounds limits hold and motors give way, so that the rounds come to an end.
inline constexpr int last_limit_rounds = 1, last_motor_rounds = 2;

}  // namespace joints

/// Rounds in which Bullet's links and the contacts are solved in turn, in the rigid world. Bullet
/// alone solves contacts and then links. LazyCCD finds contacts after Bullet's links are solved, so
/// links near contacts are solved again. Otherwise tetrahedra turn inside out, and weights sink in.
namespace links {

/// m/s. Links that move nodes more slowly than this end the rounds.
inline constexpr double min_link_speed = 0.25;
/// Of bodies that have them in each contact: this many rounds by position iteration, and at least
/// so many. With one by iteration, more tetrahedra turn inside out than with Bullet, whose contacts
/// let nodes sink in.
inline constexpr int rounds_by_iteration = 2, min_rounds_in_contact = 8;
/// Under load, links are solved again if one contact moves a node by more than this multiple of
/// the median edge of its body in the step. With half of it boxes on a pinned cloth did not come to
/// rest; with twice of it a ball with pressure did not stay round (tests/long/numbers.md). With 0.7
/// a node of a ball that a hand enters gets too fast (behaviour scenes).
inline constexpr double min_pushed_fraction = 0.6;
inline constexpr int max_rounds_under_load = 4;
/// Under weights the mean of how far they push counts, in median edges too. Rounds begin above
/// the first value and go on above the second. Reason: the number of rounds is the stiffness of the
/// body. If it followed the load, the body would throw the weight up, and nothing would rest.
inline constexpr double min_weighed_fraction = 0.25, min_weighed_fraction_to_go_on = 0.05;
inline constexpr int max_rounds_under_weight = 10;
/// Seconds. The rounds go on for so long while the weight bounces or presses less.
inline constexpr double weighed_seconds = 3;
/// Seconds without rounds after a body was pushed apart from another one. What came out may fall on
/// it, and stiff links would throw its nodes.
inline constexpr double apart_seconds = 2;
/// A body is a weight, much heavier than nodes, if at least this part of the contact's motion is
/// theirs.
inline constexpr double min_part_of_nodes = 0.9;
/// A weight presses if it approaches by more than this part of what gravity moves it in a step, and
/// gravity pulls it there by this part. Less is what a body at rest moves by itself.
inline constexpr double min_part_of_gravity = 0.25;
/// Rounds of one StrainLimit::hold(), of which a step has up to two. Rows that hold some links
/// stretch others: cloth under 1 000 times its mass was stretched 33 times with one round, 14 with
/// four (tests/long/stretch.md).
inline constexpr int strain_rounds = 4;
/// Of the limit: a link that is longer gets a row. With 1, what the sweeps leave would come again.
inline constexpr double strain_tolerance = 1.01;

}  // namespace links

/// Contacts that are expected to stay, in the implicit damping of the deformable world. Without
/// them, bodies are too soft where they are touched.
namespace expected_contacts {

/// Where damping adds less than this fraction to the inertia of the nodes in contact, contacts and
/// damping hardly change each other.
inline constexpr double min_damping_ratio = 0.1;
/// m/s. Points that leave each other more slowly than this may stay in contact.
inline constexpr double min_leaving_speed = 0.01;
/// Cosine of the normals before and after a step; where it turned more, the contact is another one.
inline constexpr double min_normal_cosine = 0.99;
/// Solves with expected contacts, each without those that the one before found unlikely. Then all
/// are dropped. With more, a step may be solved many times for contacts that end.
inline constexpr int max_solves = 3;

}  // namespace expected_contacts

/// The rounds of detection and response, and what follows where impulses do not help.
namespace rounds {

/// Solves with full target gaps. After them, gaps that cannot all be kept are halved before each
/// solve. What is between two driven bodies has no room for full gaps.
inline constexpr int solves_with_full_gaps = 1;
/// Down to this fraction. With less, a gap would be as small as what the sweeps leave.
inline constexpr double min_gap_fraction = 1.0 / 16;
/// Of the target gap: a row that keeps this much keeps its gap.
inline constexpr double fulfilled_fraction = 0.9;
/// If so many rounds do not halve the number of crowded contacts, impulses do not help, and impact
/// zones take the island.
inline constexpr std::size_t rounds_to_halve = 4;
/// Contacts of an island; fewer are not crowded.
inline constexpr std::size_t min_crowded_contacts = 100;
/// Radians. Largest rotation of an impact zone in one step. With more, the linear path of a node
/// would leave the circle too far.
inline constexpr double max_zone_rotation = 1;
/// Of a node's displacement: a driven node that differs by no more from a body moves along with it.
/// More than rounding, and far less than what stretches an edge.
inline constexpr double moves_along_tolerance = 1e-3;
/// Detections in which the fail-safe holds only the nodes in contact. After them it holds whole
/// bodies, so that the detections come to an end.
inline constexpr int max_node_holds = 16;

}  // namespace rounds

/// Velocities after the response.
namespace velocity {

/// A node pushed at its end by something heavy leaves with twice its speed in an elastic impact.
/// Nodes at a lever get no more, and energy rises by no more than driven bodies give that way.
inline constexpr double elastic_factor = 2;

}  // namespace velocity

/// Parting what touches at the start.
namespace touching {

/// Of the bound of rounding: a pair with a gap of at least this is parted. Pairs are parted to the
/// whole bound, and rounding takes up to a quarter of it back.
inline constexpr double parted_fraction = 0.5;
/// Passes over the pairs. Each moves a vertex out of all that it touches. What lies between two
/// bodies without room would move to and fro forever; it keeps touching.
inline constexpr int max_passes = 8;

}  // namespace touching

/// Moving apart what starts inside of something else.
namespace untangling {

/// 1/s, of the depth. What is deep inside of a rigid body comes out at this rate, where
/// `untangling_speed` alone would take many seconds.
inline constexpr double exit_rate = 6;
/// Of the untangling speed: gaps of bodies that are moved apart widen so fast. The bodies move too;
/// with the whole speed more of their edges pass through faces at first.
inline constexpr double gap_speed = 0.5;
/// Seconds without progress after which a pair is given up. Otherwise what cannot come out, as a
/// ring around a pole, is pulled forever.
inline constexpr double max_seconds_without_progress = 3;
/// Depth, of the one before, below which there is progress. What lies deep in a rigid body is
/// pushed at six times its depth a second, so it is far faster.
inline constexpr double min_progress = 0.9;
/// Cosine of the angle between the opposite of a side and the normal of another one that faces away
/// from it. What passes through both would have to let go of the whole body.
inline constexpr double faces_away = 0.5;
/// The same for any side that faces backward. Of perpendicular sides only rounding is between them.
inline constexpr double faces_backward = 0.01;
/// Of the diagonal of its box: a solid is convex if no corner is higher above a face.
inline constexpr double convex_tolerance = 1e-4;
/// Winding number above which a point is inside of a closed surface, between 0 outside and 1.
inline constexpr double inside_winding = 0.5;

}  // namespace untangling

}  // namespace lazyccd::bullet::settings
