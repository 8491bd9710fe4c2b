#pragma once

#include "apps/campaign/campaign_folder.h"

namespace walkman::apps {

/// Does what is still to be done of a chunk: the golden twin, unless its result is there, and every run that
/// has no record.
///
/// The twin goes once more through its task in this process. Where a phase begins in which faults are to
/// come, a child is forked off for each of them, one after the other: plant, nodes, drivers and pipeline are
/// then to the bit what they were, since the child has all of its parent's memory. It breaks what is to
/// break, goes on to its end, and writes its record. A child that dies or hangs gets its record here. The
/// process must have one thread, so it keeps TBB from making others.
///
/// Throws std::logic_error for a defect, EnvironmentError when nothing can be written, when there are no
/// processes, or when a child was ended from outside.
void run_chunk(const CampaignFolder& folder, const CampaignChunk& chunk);

}  // namespace walkman::apps
