-- Nodes of real systems wrote down their own messages only: what ROS or others sent and took is not
-- judged, nor a message that only its receiver wrote down.
DELETE FROM found_link AS f
WHERE NOT EXISTS (
    FROM truth_time AS t
    WHERE f.to_kind = t.kind AND f.to_host = t.host AND f.to_pid = t.pid AND f.to_tid = t.tid
        AND f.to_ns = t.ts_ns
        AND (
            f.to_kind = 'publication'
            OR EXISTS (
                FROM truth_link AS l
                -- The truth has one of the two; the other one is wrong.
                WHERE t.id = l.to_id
                    AND (f.kind = l.kind OR f.kind IN ('goal_accepted', 'goal_rejected'))
            )
        )
);

-- A result near a gap may be of another goal, and is marked. So may be what follows from it.
UPDATE found_link AS f SET is_guess = true
WHERE kind = 'goal_accepted' AND EXISTS (
    FROM found_link AS r
    WHERE r.kind = 'goal_result' AND r.is_guess AND f.from_id = r.from_id
);

-- A node that answers no message has no true link of these kinds, but may have invented ones.
INSERT INTO judged VALUES ('direct'), ('take_adjacent');
