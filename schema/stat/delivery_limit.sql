-- name: derive.delivery_limit
-- kind: macro
-- description: What deliveries are taken to be like. All numbers that the reasons for missing ones
--     know are here, each with its reason.
CREATE OR REPLACE MACRO derive.delivery_limit() AS {
    -- Half of the messages arrive within the usual time, hardly any after ten times that: a reader
    -- that waits for so long has none to come, and one that takes one so late got no CPU.
    'patience_factor': 10,
    -- What a busy machine keeps any thread waiting for, however quick its messages are.
    'least_patience_ns': 1000000,
    -- A message that took longer than this shows it; where none did, or none arrived, it may need
    -- so long: a scheduler's turns among other threads.
    'longest_ns': 10000000,
    -- One message alone may be lost at any time: so many in a row are what a queue lost.
    'least_row': 2,
    -- A stamp and the events of its publication lie no farther apart, with what is not known of the
    -- difference of their clocks.
    'stamp_slack_ns': 1000000
}
