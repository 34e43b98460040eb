-- title: The take that a message is about
-- description: Of a take itself, of a publication the take with the longest latency, of a callback
--     instance what it took.
-- grain: at most one row
-- param: kind VARCHAR  'take', 'publication' or 'callback_instance'
-- param: id BIGINT  Which one
-- column: take_id BIGINT  Identity of the take
-- column: topic_name VARCHAR [topic]  Its topic
-- column: run_id BIGINT  Its run
SELECT t.take_id, s.topic_name, t.run_id
FROM main.take AS t
JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
LEFT JOIN main.link_transport AS l ON t.take_id = l.take_id
LEFT JOIN main.callback_instance AS i ON t.take_id = i.take_id
WHERE CASE $kind
    WHEN 'take' THEN t.take_id
    WHEN 'publication' THEN l.publication_id
    WHEN 'callback_instance' THEN i.callback_instance_id
END = $id
ORDER BY l.latency_ns DESC NULLS LAST, t.take_id
LIMIT 1
