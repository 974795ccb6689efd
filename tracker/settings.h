// The constants of the tracker's estimation, in one place, each with its meaning. Found on synthetic takes with known
// truth (tests/tracker/README.md says how), the takes' own recordings left out of the statistics each time.
#pragma once

namespace volto::tracker {

struct Settings {
  // --- Measurement
  double point_noise_mm = 0.4;  // deviation of a landmark from the model: detector noise and what the model cannot say
  double outlier_mm = 4.0;      // a residual beyond this pulls no harder than this (Huber)

  // --- One frame
  double linear_within_rad = 1e9;  // the fit is linearised anew when the head has turned by more than this since

  // --- The face at rest: mean face plus a smooth warp (Gaussian process over the mask, nearly symmetric)
  double shape_deviation_mm = 1.6;  // how far a face differs from the mean, at the mean's size
  double shape_reach_mm = 15.0;     // over what distance neighbours differ together
  double shape_point_mm = 0.4;      // how far each point differs on its own
  double shape_asymmetry = 0.05;    // share of the variance that is not mirror symmetric
  double shape_size = 0.03;         // 3D: how far the size, taken from one frame, may be off, as a share

  // --- Expression
  double correlation = 0.5;  // how much of the measured correlation between shapes is believed
  double expression_memory_s =
      0.25;                 // over what time an expression persists (Ornstein-Uhlenbeck); 0: frames are independent
  double habit_frames = 5;  // the general statistics count as much as so many independent frames of this actor

  // --- Estimating the neutral
  double independent_frames = 60;  // at most so many frames of a take are counted as independent
  double independent_s = 0.25;     // frames closer than this tell the same
  double rest_quantile = 0.02;     // the weight that a shape falls to when it rests: this quantile over the take ...
  double rest_deviation = 0.005;   // ... is at zero up to this deviation
  int take_keyframes = 160;        // frames of a take that are looked at
  int take_passes = 40;
  int stream_keyframes = 80;       // live: frames kept
  int early_passes = 12;           // live: until the store has been gone through so often ...
  int early_pieces_per_frame = 3;  // ... so many stored frames are looked at again with each new one,
  int pieces_per_frame = 1;        // then so many
  double stream_interval_s = 0.1;  // live: first spacing between them; doubled whenever the store is full
};

}  // namespace volto::tracker
