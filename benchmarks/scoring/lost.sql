-- Of the messages that are called lost, those that were not: nodes of real systems wrote down which
-- messages they heard. A message is lost if its subscription heard an earlier and a later one of the
-- same process, and not this one. Ids count the messages of a process.
CREATE OR REPLACE TEMP TABLE lost AS
WITH published AS (
    SELECT b.publication_id, s.topic, s.id, s.pid
    FROM truth_sent AS s
    JOIN truth_time AS t ON t.kind = 'publication' AND s.sent = t.id
    JOIN place AS p ON t.host = p.host AND t.pid = p.pid AND t.tid = p.tid
    JOIN analysed.store.publication AS b ON p.thread_id = b.thread_id AND t.ts_ns = b.start_ns
    WHERE s.k = 'publication'
),
said AS (
    -- A node with a name that others have, too, goes with its host or process.
    SELECT p.*, regexp_replace(n.full_name, '@.*', '') AS node
    FROM analysed.main.stat_delivery AS d
    JOIN published AS p ON d.publication_id = p.publication_id
    JOIN analysed.store.subscription AS s ON d.subscription_id = s.subscription_id
    JOIN analysed.store.node AS n ON s.node_id = n.node_id
    WHERE d.status = 'lost'
),
heard AS (
    SELECT c.node, c.name AS topic, p.pid, p.id
    FROM truth_callback AS c
    JOIN published AS p ON c.name = p.topic AND c.id = p.id
    WHERE c.kind = 'sub'
)
SELECT
    s.publication_id,
    count(*) FILTER (h.id < s.id) > 0
    AND count(*) FILTER (h.id > s.id) > 0
    AND count(*) FILTER (h.id = s.id) = 0 AS is_lost
FROM said AS s
LEFT JOIN heard AS h ON s.node = h.node AND s.topic = h.topic AND s.pid = h.pid
GROUP BY s.publication_id, s.node;
