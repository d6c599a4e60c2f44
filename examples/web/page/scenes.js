// The scenes, in the order of page_scenes() of native/scenes.cpp.
//
// fastest: m/s, end of the slider
// faces: of the soft bodies, "smooth" or "flat"
// camera: the point that it turns about, m; its distance, m; its angles, degrees
export const scenes = [
  {
    title: "Cloths on a ball",
    description: "Two cloths fall on a ball, one after the other.",
    fastest: 30,
    faces: "smooth",
    camera: { target: [0, -0.12, 0], distance: 2.8, turn: 35, height: 20 },
  },
  {
    title: "Cloth on cloth",
    description: "A cloth flies at a larger one that is pinned along its border.",
    fastest: 30,
    faces: "smooth",
    camera: { target: [0, -0.1, 0], distance: 3.6, turn: 30, height: 18 },
  },
  {
    title: "Ball on a net",
    description: "A rigid ball flies into a cloth that is pinned along its border.",
    fastest: 30,
    faces: "smooth",
    camera: { target: [0, -0.1, 0], distance: 3.2, turn: 30, height: 16 },
  },
  {
    title: "Skirt",
    description: "A skirt hangs from a swaying waist, around two swinging legs.",
    fastest: 30,
    faces: "smooth",
    camera: { target: [0, -0.42, 0], distance: 2.1, turn: 35, height: 10 },
  },
  {
    title: "Soft boxes",
    description: "Ten soft boxes fall on the ground and on each other.",
    fastest: 30,
    faces: "flat",
    camera: { target: [0, 0.4, 0], distance: 3, turn: 30, height: 14 },
  },
];
