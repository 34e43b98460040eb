-- title: Requests that several calls could have sent
-- description: Requests were taken for which several calls of the client have the same number. They
--     are left without a sender.
-- cause: The numbers of a client began anew, as when its process was started again with the same
--     identity, or events of the service were lost.
-- cure: None needed. How long these requests took is not known.
-- grain: one row, if there are any
-- severity: warning
-- when: staging.client_gid
WITH ambiguous_request AS (
    SELECT DISTINCT t.event_id
    FROM staging.service_event AS t
    JOIN staging.client_gid AS g ON t.gid = g.gid
    JOIN staging.client_event AS s
        ON g.client_event_id = s.client_event_id AND t.sequence_number = s.sequence_number
    ANTI JOIN staging.exchange AS p ON t.event_id = p.event_at_service
    WHERE t.is_request AND s.is_request
)
SELECT
    count(*) AS count,
    'requests taken by a service for which several requests of the same client and number are '
    || 'possible: they are left without a sender' AS detail
FROM ambiguous_request
HAVING count(*) > 0
