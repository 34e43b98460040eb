-- description: What a reason for a missing delivery means: the queue was full, the message was lost
--     on the way, the two were not connected yet or any more, the recording ended before it could
--     be taken, or the trace does not show it.
CREATE OR REPLACE MACRO derive.delivery_status(reason) AS
CASE
    WHEN reason = 'overwritten' THEN 'dropped'
    WHEN reason IN ('take_failed', 'not_delivered', 'lost_in_transport') THEN 'lost'
    WHEN reason IN (
        'before_subscription', 'subscription_ended', 'never_taken', 'before_discovery'
    ) THEN 'not_connected'
    WHEN reason = 'pending_at_end' THEN 'cut_by_recording'
    ELSE 'unknown'
END
