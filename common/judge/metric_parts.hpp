// The parts of compute_metrics() (metrics.hpp). Each sets metrics of the published list, or says why they are absent.
#pragma once

#include "common/judge/alignment.hpp"
#include "common/judge/metrics.hpp"

namespace farhand {

// Over the windows of the scene.
void free_motion_metrics(const AlignedSession& a, const scene::Scene& scene, Metrics& out);
void contact_metrics(const AlignedSession& a, const scene::Scene& scene, Metrics& out);

// Over the whole run: times, largest values, energies, what the laws estimated; force that the therapist feels although
// nothing touches the patient's side; friction of the patient's device, as the box took it.
void run_metrics(const Session& session, const scene::Scene& scene, const AlignedSession& a, Metrics& out);
void phantom_metrics(const AlignedSession& a, const scene::Scene& scene, Metrics& out);
void friction_metrics(const DeviceFriction& box, Metrics& out);

// Of the network, and of the PCs' clocks.
void network_metrics(const Session& session, const AlignedSession& a, Metrics& out);
void clock_metrics(const Session& session, Metrics& out);

}  // namespace farhand
