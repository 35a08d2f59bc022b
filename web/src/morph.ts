// Makes the children of an element equal to others and changes only what differs: focus, selection and scroll positions of the
// rest remain. Listeners of elements that are kept remain as well, so that this is for elements without listeners.

function sameKind(a: Node, b: Node): boolean {
  return a.nodeType === b.nodeType && a.nodeName === b.nodeName;
}

function adopt(old: Element, next: Element) {
  for (const { name } of [...old.attributes]) if (!next.hasAttribute(name)) old.removeAttribute(name);
  for (const { name, value } of [...next.attributes]) if (old.getAttribute(name) !== value) old.setAttribute(name, value);
  morph(old, [...next.childNodes]);
}

export function morph(parent: Element, children: (Node | string)[]) {
  const next = children.map((child) => (typeof child === 'string' ? document.createTextNode(child) : child));
  while (parent.childNodes.length > next.length) parent.lastChild!.remove();
  next.forEach((child, i) => {
    const old = parent.childNodes[i] as ChildNode | undefined;
    if (!old) parent.append(child);
    else if (old.isEqualNode(child)) return;
    else if (!sameKind(old, child)) old.replaceWith(child);
    else if (old instanceof Element) adopt(old, child as Element);
    else old.nodeValue = child.nodeValue;
  });
}
