#pragma once

#include "apps/campaign/campaign_folder.h"

namespace walkman::apps {

/// Thrown when a run's process ended because the machine lacks something; it has said what. Not a
/// std::exception, because nothing is left to say.
struct RunLacked {};

/// Completes a chunk: runs the golden twin unless its result exists, and every run that has no record.
///
/// The twin then repeats its task in this process. At the start of each phase in which faults are to begin, a
/// child is forked for each of them, one after the other; a child has all of its parent's memory, so its
/// plant, nodes, drivers and pipeline are identical bit by bit. The child injects its fault, runs to the end
/// and writes its record. The record of a child that dies or hangs is written here. The process must be
/// single-threaded, so TBB is kept from creating threads.
///
/// Throws std::logic_error for a defect, EnvironmentError if nothing can be written, if no process can be
/// created, or if a child was terminated from outside, and RunLacked.
void run_chunk(const CampaignFolder& folder, const CampaignChunk& chunk);

}  // namespace walkman::apps
