"""The paper's method, Algorithms 1-3, and nothing else.

The paper is "Multi-Robot Multi-Goal Mission Planning in Terrains of Varying Energy
Consumption". This is our implementation of it, not its authors' code. The algorithms as
they are implemented here; comments in the code name these lines:

    Algorithm 1: planning
     1  ConstructPRM                                  `roadmap.build_roadmap`
     2  T <- InitMotionTree                           `planner.new_tree`
     3  Insert(T, q_init)                             `_growth_kernels.grow`
     4  until solved:
     5    g <- SelectGroup(T)                         `_selection_kernels`
     6    v <- SelectVertex(g)
     7    tour <- GetTour(v)
     8    q <- SampleTarget(tour)
     9    ExtendTowards(T, v, q)
    10  ExtractPaths(T)                               `planner`

    Algorithm 2: Insert(T, v, state)                  `_expansion_kernels.insert`
     1  tour <- v.tour
     2  if v is none, a goal or station of the tour is reached, or it is infeasible:
     3    tour <- CreateNewTour by NRPA               `_tours_kernels`
     4    if there is none: return none
     5  add the vertex with parent v
     6  its SetTour(tour)
     7  g <- group of its regions and visited goals   `_tree_kernels.find_group`
     8  add the vertex to g

    Algorithm 3: ExtendTowards(T, v, q)               `_expansion_kernels`
     1  visits <- expansions of v's group
     2  for each robot:
     3    u <- random control
     4    if random < Decay(visits):
     5      u <- Steer(v, q)
     6  for up to k steps:
     7    for each robot:
     8      state <- Simulate(v, u, dt)
     9    if not CollisionFree(state):
    10      break
    11    v_new <- Insert(T, v, state)
    12    v <- v_new

Groups have the same region (nearest roadmap vertex) of every robot and the same visited
goals. They are selected by eq. (5), w = lambda^VISITS (alpha / |unvisited goals| + beta
dist(group)). VISITS and the visits of Algorithm 3 are one number.

What the paper leaves open, our choice, and why:

- Decay: falls from decay_start, near 1, by decay_rate to decay_least, which lets groups
  that have been expanded often go on steering. Robots have a draw each, so that one may
  try something while others go on.
- SampleTarget: a point of the roadmap's path from the robot's region to its first
  target, a random length ahead, moved by a random offset. Near targets follow the path,
  far ones cut corners: either may be what the place needs. A robot whose tour is over
  has no target, and Steer brakes it.
- dist: the number of steps from the root to the group's nearest vertex; a count needs
  no unit. beta = 0.01 alpha / (m D) for m goals, with D the smallest power of two that
  no dist exceeds, so that beta dist <= 0.01 alpha / m always.
- |unvisited goals| = 0, where only the stop is missing, counts as 1.
- Bias: with probability `bias` the heaviest group is taken, else one is drawn by
  weight.
- Region of a moving robot: that of its reference point; heading and speed do not count.
  Vertices without a path to any target are no regions.
- g.GetTour of a group against v.SetTour of a vertex: the tour is the vertex's. The
  vertices of a group may have come there with different energy.
- A vertex chosen by its distance to a target that is sampled afterwards: the distance
  is that to the middle of where SampleTarget will draw it, summed over the robots. The
  probability is in proportion to exp(-distance / vertex_spread).
- Line 12 of Algorithm 3 after a rejected Insert: the expansion ends. There is no vertex
  to go on from, and steps after an infeasible one are infeasible.
- CollisionFree covers the limits of speed and steering, too: random controls leave
  them. States keep 0.25 m from obstacles and 0.5 m between robots, so that the motion
  between two steps is free and can be tracked; where less is kept, robots are followed
  through each step.
- Steer: pure pursuit, in reverse if the target is behind and the robot can
  (`_expansion_kernels.steer`), for the time that the control is held.
- u_stop is not used by Algorithms 1-3. We call a mission solved when all goals are
  visited and all robots can brake at once without a collision; that stop is ours, and
  is appended to the paths.
- Eq. (1) prints x' = cos theta, without v: we take x' = v cos theta
  (`motion.dynamics`).
- A tour is feasible if every battery lasts, above its reserve, along the roadmap to the
  robot's next station or end. NRPA draws tours with a margin on energies, as driving
  takes more than by the roadmap; feasibility is judged without it.
- Stations recharge the robot whose tour leads there next, once each time it enters: no
  tour begins with a station that the robot is in, but at the start. Goals count for any
  robot.
- Parameters: `parameters.paper_params`, tuned on seeds from 1000 on; results are of
  seeds 0-49. The number of iterations has a hard cap, which is reported with results.

Features of scenes that the paper lacks are refused by name (`limits`).
"""
