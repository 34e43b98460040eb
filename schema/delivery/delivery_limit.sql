-- description: All numbers in the rules about missing deliveries; each with its reason.
CREATE OR REPLACE MACRO derive.delivery_limit() AS {
    -- Half of the messages arrive within the usual time, hardly any after ten times that. A reader
    -- that waits for so long has no message to come; one that takes a message so late got no CPU.
    'patience_factor': 10,
    -- A busy machine may keep any thread waiting for so long, however quick its messages are.
    'least_patience_ns': 1000000,
    -- A message may need so long, even if none was seen to, or none arrived: a scheduler takes its
    -- turns among other threads. Where one was seen to need longer, that counts.
    'longest_ns': 10000000,
    -- A single message may get lost at any time. So many missing in a row were lost by a queue.
    'least_row': 2,
    -- A stamp and the events of its publication are no farther apart than this, including what is
    -- not known of the difference of their clocks.
    'stamp_slack_ns': 1000000
}
